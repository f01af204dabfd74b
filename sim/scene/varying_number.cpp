#include "sim/scene/varying_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/hand/hand_pose.h"
#include "sim/scene/input.h"
#include "sim/scene/scene_table.h"

namespace touchfield {

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Slope at the end of a chord of length h, from it and the chord beyond.
double end_slope(double h, double chord, double next_h, double next_chord) {
  const double slope = ((2.0 * h + next_h) * chord - h * next_chord) / (h + next_h);
  if (slope * chord <= 0.0) {
    return 0.0;
  }
  return chord * next_chord < 0.0 && std::abs(slope) > 3.0 * std::abs(chord) ? 3.0 * chord : slope;
}

std::vector<double> monotone_slopes(const std::vector<std::array<double, 2>>& keys) {
  const std::size_t n = keys.size();
  std::vector<double> slopes(n, 0.0);
  if (n < 2) {
    return slopes;
  }
  std::vector<double> h(n - 1);
  std::vector<double> chord(n - 1);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    h[i] = keys[i + 1][0] - keys[i][0];
    chord[i] = (keys[i + 1][1] - keys[i][1]) / h[i];
  }
  if (n == 2) {
    return {chord[0], chord[0]};
  }
  for (std::size_t i = 1; i + 1 < n; ++i) {
    if (chord[i - 1] * chord[i] > 0.0) {
      const double before = 2.0 * h[i] + h[i - 1];
      const double after = h[i] + 2.0 * h[i - 1];
      slopes[i] = (before + after) / (before / chord[i - 1] + after / chord[i]);
    }
  }
  slopes.front() = end_slope(h[0], chord[0], h[1], chord[1]);
  slopes.back() = end_slope(h[n - 2], chord[n - 2], h[n - 3], chord[n - 3]);
  return slopes;
}

using Parts = std::vector<std::string>;

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

/// The number N in parts like bodies.N, which become one: body.
Item take_item(Parts& parts, std::size_t at, const char* several, const char* one) {
  const bool named = parts.size() > at + 1 && parts[at] == several;
  const Item item = named ? number_of<std::size_t>(parts[at + 1]) : std::nullopt;
  if (item) {
    parts[at] = one;
    parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(at) + 1);
  }
  return item;
}

/// With items of lists in brackets.
std::string path_text(const Parts& parts) {
  std::string text;
  for (const std::string& part : parts) {
    text += number_of<std::size_t>(part) ? fmt::format("[{}]", part) : (text.empty() ? "" : ".") + part;
  }
  return text;
}

double& coordinate(Posture& scene, const Item& item, const std::string& key, Eigen::Index axis) {
  if (key == "body.place.at_mm") {
    return body_of(scene, item).place.at[axis];
  }
  if (key == "body.place.rotate_deg") {
    return body_of(scene, item).place.angles[axis];
  }
  require(scene.target && !scene.target->boxes.empty(), "is not in this scene, which has no target box");
  auto& boxes = scene.target->boxes;
  TargetBoxSpec& box = item_of(boxes, boxes.size() == 1, item, "target.box", "target.boxes");
  const bool offset = key == "target.box.offset_mm";
  if (offset == box.at.empty()) {
    throw InputError(offset ? "is not in this scene: its box has centre_mm"
                            : "is not in this scene: its box has a landmark and offset_mm");
  }
  return (offset ? box.offset : box.centre)[axis];
}

double& joint_angle(Posture& scene, const Item& item, Eigen::Index joint) {
  auto* hand = std::get_if<HandShape>(&body_of(scene, item).shape);
  require(hand != nullptr, "is not in this scene: its body is not a built-in hand");
  std::optional<double>& angle = joint_in(hand->joints, joint);
  return angle ? *angle : angle.emplace(joint_angles(hand_pose(hand->pose, hand->joints))(joint));
}

double& pressure(Posture& scene, TargetQuantity quantity) {
  const bool of_radiation = quantity == TargetQuantity::kRadiation;
  if (scene.target && scene.target->quantity != quantity) {
    throw InputError(
        fmt::format("is not in this scene: its target has {}", of_radiation ? "pressure_pa" : "radiation_pa"));
  }
  require(scene.target && scene.target->pressure, "must be a number in this scene");
  return *scene.target->pressure;
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

MotionCurve::MotionCurve(MotionLaw law, double own) : law_(std::move(law)), own_(own) {
  if (const auto* through = std::get_if<KeysLaw>(&law_)) {
    slopes_ = monotone_slopes(through->keys);
  }
}

double MotionCurve::operator()(double seconds) const {
  return std::visit([&](const auto& law) { return at(law, seconds); }, law_);
}

double MotionCurve::at(const SineLaw& law, double seconds) const {
  return law.about.value_or(own_) + law.amplitude * std::sin(kTurn * law.hz * seconds + law.phase);
}

double MotionCurve::at(const RateLaw& law, double seconds) const { return own_ + law.rate * seconds; }

double MotionCurve::at(const KeysLaw& law, double seconds) const {
  const auto& keys = law.keys;
  const auto after =
      std::ranges::upper_bound(keys, seconds, {}, [](const std::array<double, 2>& key) { return key[0]; });
  if (after == keys.begin()) {
    return keys.front()[1];
  }
  if (after == keys.end()) {
    return keys.back()[1];
  }
  const auto& [from, first] = *(after - 1);
  const auto& [to, last] = *after;
  const auto i = static_cast<std::size_t>(after - keys.begin());
  const double h = to - from;
  const double s = (seconds - from) / h;
  const double r = 1.0 - s;
  const double value = r * r * ((1.0 + 2.0 * s) * first + s * h * slopes_[i - 1]) +
                       s * s * ((1.0 + 2.0 * r) * last - r * h * slopes_[i]);
  return std::clamp(value, std::min(first, last), std::max(first, last));  // of rounding
}

std::vector<double> MotionCurve::turns(double seconds) const {
  std::vector<double> times = {0.0};
  if (const auto* through = std::get_if<KeysLaw>(&law_)) {
    for (const auto& [time, value] : through->keys) {
      if (time > 0.0 && time < seconds) {
        times.push_back(time);
      }
    }
  } else if (const auto* sine = std::get_if<SineLaw>(&law_)) {
    // The first highest and the first lowest point; later ones are as high and low.
    const double quarter = 0.25 - sine->phase / kTurn;  // of a period, a turn later or earlier too
    for (const double turn : {quarter - std::floor(quarter), quarter + 0.5 - std::floor(quarter + 0.5)}) {
      if (turn > 0.0 && turn < seconds * sine->hz) {
        times.push_back(turn / sine->hz);
      }
    }
    std::ranges::sort(times);
  }
  times.push_back(seconds);
  return times;
}

std::string varying_paths() {
  return "body.place.at_mm.0 to .2, body.place.rotate_deg.0 to .2, body.hand.joints.FINGER.JOINT_deg, "
         "target.box.offset_mm.0 to .2, target.box.centre_mm.0 to .2, target.pressure_pa, target.radiation_pa (of "
         "several bodies.0, "
         "target.boxes.0 and so on)";
}

VaryingNumber varying_number(const std::string& path) {
  Parts parts = schema::split_path(path).value_or(Parts{""});
  VaryingNumber number;
  number.path = path_text(parts);
  const Item body = take_item(parts, 0, "bodies", "body");
  const Item item = body ? body : take_item(parts, 1, "boxes", "box");
  const std::string last = parts.back();
  const std::string key = fmt::format("{}", fmt::join(parts.begin(), parts.end() - 1, "."));

  const auto axis = number_of<Eigen::Index>(last);
  const bool turns = key == "body.place.rotate_deg";
  const bool moves = key == "body.place.at_mm" || key == "target.box.offset_mm" || key == "target.box.centre_mm";
  if ((turns || moves) && axis && *axis >= 0 && *axis < 3) {
    number.unit = turns ? schema::kDegrees : schema::kMillimetres;
    number.in = [=](Posture& scene) -> double& { return coordinate(scene, item, key, *axis); };
    return number;
  }
  if (key == "target" && (last == "pressure_pa" || last == "radiation_pa")) {
    const TargetQuantity quantity = last == "radiation_pa" ? TargetQuantity::kRadiation : TargetQuantity::kPressure;
    number.range = schema::at_least(0);  // a motion may begin and end in silence
    number.in = [=](Posture& scene) -> double& { return pressure(scene, quantity); };
    return number;
  }
  const auto joint = std::ranges::find_if(hand_joints(), [&](const NamedJoint& of_hand) {
    return key == fmt::format("body.hand.joints.{}", of_hand.digit) && last == fmt::format("{}_deg", of_hand.name);
  });
  require(joint != hand_joints().end(), "cannot vary, must be one of {}", varying_paths());
  number.unit = schema::kDegrees;
  number.range = schema::between(joint->least, joint->most);
  number.in = [=, place = joint - hand_joints().begin()](Posture& scene) -> double& {
    return joint_angle(scene, item, place);
  };
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
