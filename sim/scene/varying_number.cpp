#include "sim/scene/varying_number.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/body/hand_pose.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text_number.h"
#include "sim/scene/overrides.h"
#include "sim/scene/scene_table.h"

namespace touchfield {

namespace {

template <class Joints, class Angles>
struct Joint {
  const char* key;
  std::optional<double> Joints::*given;
  double Angles::*posed;
};

constexpr Joint<ThumbJoints, ThumbAngles> kThumb[] = {
    {"cmc_flexion_deg", &ThumbJoints::cmc_flexion, &ThumbAngles::cmc_flexion},
    {"cmc_abduction_deg", &ThumbJoints::cmc_abduction, &ThumbAngles::cmc_abduction},
    {"cmc_rotation_deg", &ThumbJoints::cmc_rotation, &ThumbAngles::cmc_rotation},
    {"mcp_deg", &ThumbJoints::mcp, &ThumbAngles::mcp},
    {"ip_deg", &ThumbJoints::ip, &ThumbAngles::ip}};
constexpr Joint<FingerJoints, FingerAngles> kFinger[] = {
    {"abduction_deg", &FingerJoints::abduction, &FingerAngles::abduction},
    {"mcp_deg", &FingerJoints::mcp, &FingerAngles::mcp},
    {"pip_deg", &FingerJoints::pip, &FingerAngles::pip},
    {"dip_deg", &FingerJoints::dip, &FingerAngles::dip}};
constexpr std::pair<const char*, FingerJoints HandJoints::*> kFingers[] = {
    {"index", &HandJoints::index},
    {"middle", &HandJoints::middle},
    {"ring", &HandJoints::ring},
    {"little", &HandJoints::little}};  // in the order of HandPose::fingers

using Parts = std::vector<std::string>;

/// The parts of a path, taken from its begin.
class PathWalk {
 public:
  explicit PathWalk(Parts parts) : parts_(std::move(parts)) {}

  bool done() const { return at_ == parts_.size(); }
  bool take(const char* key) {
    if (done() || parts_[at_] != key) {
      return false;
    }
    ++at_;
    return true;
  }
  std::optional<std::size_t> take_number() {
    const auto number = done() ? std::nullopt : number_of<std::size_t>(parts_[at_]);
    at_ += number ? 1 : 0;
    return number;
  }
  /// One of the items of a table, by its first member.
  template <class Table>
  auto take_one(const Table& table, auto key) {
    const auto* found = done() ? std::end(table) : std::ranges::find(table, parts_[at_], key);
    at_ += found != std::end(table) ? 1 : 0;
    return found != std::end(table) ? found : nullptr;
  }

  /// With items of lists in brackets.
  std::string text() const {
    std::string text;
    for (const std::string& part : parts_) {
      text += number_of<std::size_t>(part) ? fmt::format("[{}]", part) : (text.empty() ? "" : ".") + part;
    }
    return text;
  }

 private:
  Parts parts_;
  std::size_t at_ = 0;
};

/// An item of a scene's list: the only one, or one of several by its number.
using Item = std::optional<std::size_t>;

template <class T>
T& item_of(std::vector<T>& items, bool single, const Item& item, const char* one, const char* several) {
  if (item.has_value() != single && (single || *item < items.size())) {
    return items[item.value_or(0)];
  }
  throw InputError(single ? fmt::format("is not in this scene, which has one: must begin with {}", one)
                          : fmt::format("is not in this scene, which has {}: must begin with {}[0..{}]", items.size(),
                                        several, items.size() - 1));
}

BodySpec& body_of(Posture& scene, const Item& item) {
  const bool single = scene.bodies.size() == 1 && scene.bodies.front().name.empty();
  return item_of(scene.bodies, single, item, "body", "bodies");
}

TargetBoxSpec& box_of(Posture& scene, const Item& item) {
  require(scene.target, "is not in this scene, which has no target");
  return item_of(scene.target->boxes, scene.target->boxes.size() == 1, item, "target.box", "target.boxes");
}

HandShape& hand_of(Posture& scene, const Item& item) {
  if (auto* hand = std::get_if<HandShape>(&body_of(scene, item).shape)) {
    return *hand;
  }
  throw InputError("is not in this scene: its body is not a built-in hand");
}

schema::Range joint_range(const std::string& finger, const std::string& joint) {
  const schema::TypeInfo joints = schema::joints_codec().type;
  const auto key = [](const schema::TypeInfo& type, const std::string& name) {
    return std::ranges::find(type.map->keys, name, &schema::KeyInfo::name)->type;
  };
  return key(key(joints, finger), joint).range;
}

/// What follows body.hand.joints.
void take_joint(PathWalk& walk, const Item& item, VaryingNumber& number) {
  number.unit = schema::kDegrees;
  const auto leave_to_pose = [](std::optional<double>& joint, double posed) -> double& {
    return joint ? *joint : joint.emplace(posed);
  };
  if (walk.take("thumb")) {
    if (const auto* joint = walk.take_one(kThumb, &Joint<ThumbJoints, ThumbAngles>::key)) {
      number.range = joint_range("thumb", joint->key);
      number.in = [=](Posture& scene) -> double& {
        HandShape& hand = hand_of(scene, item);
        return leave_to_pose(hand.joints.thumb.*joint->given, hand_pose(hand.pose, hand.joints).thumb.*joint->posed);
      };
    }
  } else if (const auto* finger = walk.take_one(kFingers, &std::pair<const char*, FingerJoints HandJoints::*>::first)) {
    if (const auto* joint = walk.take_one(kFinger, &Joint<FingerJoints, FingerAngles>::key)) {
      number.range = joint_range(finger->first, joint->key);
      const auto which = static_cast<std::size_t>(finger - std::begin(kFingers));
      number.in = [=](Posture& scene) -> double& {
        HandShape& hand = hand_of(scene, item);
        return leave_to_pose(hand.joints.*finger->second.*joint->given,
                             hand_pose(hand.pose, hand.joints).fingers[which].*joint->posed);
      };
    }
  }
}

/// What follows body.
void take_body(PathWalk& walk, const Item& item, VaryingNumber& number) {
  if (walk.take("hand")) {
    if (walk.take("joints")) {
      take_joint(walk, item, number);
    }
    return;
  }
  const bool place = walk.take("place");
  const bool at = place && walk.take("at_mm");
  if (!at && !(place && walk.take("rotate_deg"))) {
    return;
  }
  number.unit = at ? schema::kMillimetres : schema::kDegrees;
  if (const auto axis = walk.take_number(); axis && *axis < 3) {
    number.in = [=, axis = static_cast<Eigen::Index>(*axis)](Posture& scene) -> double& {
      Placement& place = body_of(scene, item).place;
      return (at ? place.at : place.angles)[axis];
    };
  }
}

/// What follows target.box.
void take_box(PathWalk& walk, const Item& item, VaryingNumber& number) {
  const bool offset = walk.take("offset_mm");
  if (!offset && !walk.take("centre_mm")) {
    return;
  }
  number.unit = schema::kMillimetres;
  if (const auto axis = walk.take_number(); axis && *axis < 3) {
    number.in = [=, axis = static_cast<Eigen::Index>(*axis)](Posture& scene) -> double& {
      TargetBoxSpec& box = box_of(scene, item);
      if (offset == box.at.empty()) {
        throw InputError(offset ? "is not in this scene: its box has centre_mm"
                                : "is not in this scene: its box has a landmark and offset_mm");
      }
      return (offset ? box.offset : box.centre)[axis];
    };
  }
}

void take_pressure(VaryingNumber& number) {
  number.range = schema::at_least(0);  // a motion may begin and end in silence
  number.in = [](Posture& scene) -> double& {
    if (!scene.target || !scene.target->pressure) {
      throw InputError("must be a number in this scene");
    }
    return *scene.target->pressure;
  };
}

/// A law whose values are in SI, of one in this unit.
MotionLaw in_si(MotionLaw law, const schema::Unit& unit) {
  const auto convert = [&](double& value) { value = unit.si(value); };
  if (auto* sine = std::get_if<SineLaw>(&law)) {
    convert(sine->amplitude);
    if (sine->about) {
      convert(*sine->about);
    }
  } else if (auto* through = std::get_if<KeysLaw>(&law)) {
    for (auto& key : through->keys) {
      convert(key[1]);
    }
  } else {
    convert(std::get<RateLaw>(law).rate);
  }
  return law;
}

}  // namespace

std::string varying_paths() {
  return "body.place.at_mm.0 to .2, body.place.rotate_deg.0 to .2, body.hand.joints.FINGER.JOINT_deg, "
         "target.box.offset_mm.0 to .2, target.box.centre_mm.0 to .2, target.pressure_pa (of several bodies.0, "
         "target.boxes.0 and so on)";
}

VaryingNumber varying_number(const std::string& path) {
  VaryingNumber number;
  PathWalk walk(schema::split_path(path).value_or(Parts{}));
  if (walk.take("body")) {
    take_body(walk, std::nullopt, number);
  } else if (walk.take("bodies")) {
    if (const auto item = walk.take_number()) {
      take_body(walk, item, number);
    }
  } else if (walk.take("target")) {
    if (walk.take("pressure_pa")) {
      take_pressure(number);
    } else if (walk.take("box")) {
      take_box(walk, std::nullopt, number);
    } else if (walk.take("boxes")) {
      if (const auto item = walk.take_number()) {
        take_box(walk, item, number);
      }
    }
  }
  if (!number.in || !walk.done()) {
    throw InputError(fmt::format("cannot vary, must be one of {}", varying_paths()));
  }
  number.path = walk.text();
  return number;
}

MotionCurve motion_curve(const VaryingNumber& number, const MotionLaw& law, double seconds, Scene& scene) {
  try {
    const double own = number.in(scene);
    const MotionCurve written(law, *schema::parse_decimal(number.unit.text(own)));
    for (const double time : written.turns(seconds)) {
      if (const auto rule = number.range.broken_by(written(time))) {
        throw InputError(fmt::format("is {:.6g} at {:.6g} s, must be {}", written(time), time, *rule));
      }
    }
    return {in_si(law, number.unit), own};
  } catch (const InputError& error) {
    throw InputError(fmt::format("{} {}", number.path, error.what()));
  }
}

}  // namespace touchfield
