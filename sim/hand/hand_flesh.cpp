#include "sim/hand/hand_flesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kBeyondCut = 6e-3;  // [m], of flesh behind an end that is cut off
// The wrist's section: the hull of two circles, shares of the breadth.
constexpr double kWristRadius = 0.20;
constexpr double kWristAside = 0.13;
constexpr double kWristHeight = -0.02;

Plate plate(const Vector3& a, const Vector3& b, const Vector3& c, double radius_a, double radius_b, double radius_c) {
  Plate result;
  result.corners << a, b, c;
  result.radii << radius_a, radius_b, radius_c;
  return result;
}

void add_quad(SoftPart& part, const std::array<Vector3, 4>& corners, const std::array<double, 4>& radii) {
  part.plates.push_back(plate(corners[0], corners[1], corners[2], radii[0], radii[1], radii[2]));
  part.plates.push_back(plate(corners[0], corners[2], corners[3], radii[0], radii[2], radii[3]));
}

constexpr std::array<const char*, 5> kDigits = {"thumb", "index", "middle", "ring", "little"};

/// How far a ray from inside the flesh goes before it leaves it, `most` if it stays inside so far.
double way_out(const SoftBody& flesh, const Vector3& start, const Vector3& direction, double most) {
  constexpr double kClose = 1e-7;  // [m]
  constexpr double kStep = 0.7;    // of the distance: the function's slope may exceed 1
  double reach = 0;
  double distance = flesh.distance(start);
  while (distance < -kClose && reach < most) {
    reach -= kStep * distance;
    distance = flesh.distance(start + reach * direction);
  }
  return std::min(reach, most);
}

/// Unit vectors evenly over the sphere, on a spiral.
Vector3 direction_of(int i, int count) {
  const double z = 1.0 - (2.0 * i + 1.0) / count;
  const double angle = 2.0 * std::numbers::pi * i / std::numbers::phi;
  const double radius = std::sqrt(1.0 - z * z);
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

Vector3 nearest_skin(const SoftBody& flesh, const Vector3& start) {
  constexpr int kDirections = 600;  // 8 degrees apart
  double least = std::numeric_limits<double>::infinity();
  Vector3 best = Vector3::UnitZ();
  for (int i = 0; i < kDirections; ++i) {
    const double reach = way_out(flesh, start, direction_of(i, kDirections), least);
    if (reach < least) {
      least = reach;
      best = direction_of(i, kDirections);
    }
  }
  return start + least * best;
}

/// Where the skin of a digit is, seen from a point within it; if it is pressed into other flesh, the skin nearest to
/// where it would be.
Vector3 skin_of_digit(const SoftBody& flesh, const Vector3& start, const Vector3& direction, double thickness) {
  constexpr double kPressed = 1.6;  // of the flesh that the digit itself has there
  const double most = kPressed * thickness;
  const double reach = way_out(flesh, start, direction, most);
  return reach < most ? Vector3(start + reach * direction)
                      : nearest_skin(flesh, start + std::min(thickness, most) * direction);
}

}  // namespace

bool curled(const BoneChain& finger) { return finger.direction(2).dot(finger.direction(0)) < -0.5; }

SoftPart palm_flesh(const HandSkeleton& hand) {
  const double b = hand.breadth;
  const double l = hand.length;
  SoftPart part;
  part.blend = 0.10 * b;
  // The flesh under the heads of the metacarpals lies towards the palm side of the joints.
  std::array<Vector3, 4> heads;
  for (std::size_t i = 0; i < 4; ++i) {
    heads[i] = hand.fingers[i].joints[0] + Vector3(0, -0.02 * l, -0.03 * b);
  }
  const std::array<double, 4> head_radii = {0.142 * b, 0.140 * b, 0.135 * b, 0.130 * b};
  const Vector3 carpus_thumb(0.15 * b, 0.06 * l, -0.03 * b);
  const Vector3 carpus_little(-0.18 * b, 0.06 * l, -0.05 * b);
  const double carpus = 0.175 * b;
  const Vector3 carpus_middle = 0.5 * (carpus_thumb + carpus_little) + Vector3(0, 0, 0.02 * b);
  add_quad(part, {carpus_thumb, heads[0], heads[1], carpus_middle}, {carpus, head_radii[0], head_radii[1], carpus});
  add_quad(part, {carpus_middle, heads[1], heads[2], carpus_little}, {carpus, head_radii[1], head_radii[2], carpus});
  part.plates.push_back(plate(carpus_little, heads[2], heads[3], carpus, head_radii[2], head_radii[3]));
  // Wrist and forearm; the cut of the body ends them.
  const double wrist = kWristRadius * b;
  const Vector3 wrist_thumb(kWristAside * b, -0.03 * l, kWristHeight * b);
  const Vector3 wrist_little(-kWristAside * b, -0.03 * l, kWristHeight * b);
  const Vector3 elbow(0, -1.3 * kHandStub, 0);
  add_quad(part, {carpus_thumb, wrist_thumb, wrist_little, carpus_little}, {carpus, wrist, wrist, carpus});
  add_quad(part, {wrist_thumb, wrist_thumb + elbow, wrist_little + elbow, wrist_little}, {wrist, wrist, wrist, wrist});
  // The ball of the little finger.
  part.cones.push_back({{-0.23 * b, 0.07 * l, -0.11 * b}, {-0.36 * b, 0.215 * l, -0.09 * b}, 0.155 * b, 0.13 * b});
  return part;
}

namespace {

SoftPart thumb_ball(const HandSkeleton& hand) {
  const double b = hand.breadth;
  const BoneChain& thumb = hand.thumb;
  const Vector3 palm_middle(0.05 * b, 0.22 * hand.length, -0.07 * b);
  SoftPart part;
  part.blend = 0.08 * b;
  part.outward_blend = 0.12 * b;
  part.cones.push_back({thumb.joints[0], thumb.joints[1], thumb.radii[0], thumb.radii[1]});
  // The muscles lie on the palm side of the metacarpal.
  const Vector3 belly = thumb.along(0, 0.45) + 0.07 * b * thumb.palmar[0];
  part.cones.push_back({belly, Vector3(0.10 * b, 0.045 * hand.length, -0.12 * b), 0.165 * b, 0.11 * b});
  part.plates.push_back(plate(thumb.joints[0], thumb.along(0, 0.75), palm_middle, 0.15 * b, 0.125 * b, 0.11 * b));
  // The fold between thumb and index finger, and the muscle behind it.
  const BoneChain& index = hand.fingers[0];
  part.plates.push_back(plate(thumb.along(1, 0.12), index.joints[0] + Vector3(0.01 * b, -0.02 * hand.length, -0.05 * b),
                              palm_middle, 0.065 * b, 0.09 * b, 0.09 * b));
  part.plates.push_back(plate(thumb.along(0, 0.1), thumb.along(0, 0.95),
                              index.joints[0] + Vector3(0, -0.06 * hand.length, -0.03 * b), 0.11 * b, 0.10 * b,
                              0.11 * b));
  return part;
}

/// Bones from `first` on, with a pad on the palm side of each segment, so that the joints show as creases between them.
SoftPart phalanges(const BoneChain& chain, int first, double breadth) {
  constexpr std::array<std::array<double, 2>, 3> kPads = {{{0.35, 0.72}, {0.30, 0.70}, {0.30, 0.68}}};  // along a bone
  constexpr double kPadOffset = 0.20;                                                                   // of the radius
  constexpr double kPadRadius = 0.86;
  constexpr double kBone = 0.97;
  SoftPart part;
  part.blend = 0.035 * breadth;
  part.outward_blend = 0.06 * breadth;
  for (int bone = first; bone < 3; ++bone) {
    const auto i = static_cast<std::size_t>(bone);
    const double start = chain.radii[i];
    const double end = bone == 2 ? chain.radii[3] : chain.radii[i + 1];
    const auto radius = [&](double t) { return start + t * (end - start); };
    const auto pad = [&](double t) { return Vector3(chain.along(bone, t) + kPadOffset * radius(t) * chain.palmar[i]); };
    const auto [from, to] = kPads[i];
    part.cones.push_back({pad(from), pad(to), kPadRadius * radius(from), kPadRadius * radius(to)});
    if (bone == 2) {
      const double tip = 0.91 * chain.radii[3];
      part.cones.push_back({chain.joints[2], chain.joints[3] - tip * chain.direction(2), kBone * start, tip});
    } else {
      part.cones.push_back({chain.joints[i], chain.joints[i + 1], kBone * start, kBone * end});
    }
  }
  return part;
}

/// A finger with the pad under its base; its inside is filled with flesh if it is curled.
SoftPart finger_flesh(const BoneChain& finger, double breadth) {
  SoftPart part = phalanges(finger, 0, breadth);
  part.cones.push_back({finger.joints[0] + 0.035 * breadth * finger.palmar[0],
                        finger.along(0, 0.5) + 0.01 * breadth * finger.palmar[0], 0.105 * breadth,
                        finger.radii[1] - 0.01 * breadth});
  if (curled(finger)) {
    part.outward_blend = 0.06 * breadth;
    const double radius = 0.75 * finger.radii[2];
    const Vector3 tip = finger.joints[3] - radius * finger.direction(2);
    add_quad(part, {finger.joints[0], finger.joints[1], finger.joints[2], tip}, {radius, radius, radius, radius});
    // The tip presses into the palm.
    const Vector3 pressed = tip + Vector3(0, 0, 0.15 * breadth);
    part.plates.push_back(plate(finger.joints[0], tip, pressed, radius, radius, radius));
  }
  return part;
}

/// The skin between two fingers' bases.
SoftPart web(const BoneChain& one, const BoneChain& other, const HandSkeleton& hand) {
  constexpr double kReach = 0.40;  // of the proximal phalanx
  const double b = hand.breadth;
  SoftPart part;
  part.blend = 0.05 * b;
  part.outward_blend = 0.06 * b;
  const auto behind = [&](const BoneChain& finger) {
    return Vector3(finger.joints[0] + Vector3(0, -0.04 * hand.length, -0.03 * b));
  };
  const auto ahead = [&](const BoneChain& finger) {
    return Vector3(finger.along(0, kReach) + 0.02 * b * finger.palmar[0]);
  };
  add_quad(part, {behind(one), ahead(one), ahead(other), behind(other)}, {0.115 * b, 0.06 * b, 0.06 * b, 0.115 * b});
  return part;
}

/// Half the section of a forearm: the hull of two circles of this radius, their centres this far from the middle.
struct ForearmSection {
  double radius;
  double aside;
};

double smooth_step(double t) { return t * t * (3.0 - 2.0 * t); }

/// behind   the wrist joint [m], kHandStub at least
ForearmSection forearm_section(const HandSkeleton& hand, double behind) {
  constexpr double kElbow = 1.36;       // behind the wrist joint, share of the hand's length
  constexpr double kWidest = 1.02;      // likewise
  constexpr double kStartGirth = 1.83;  // over the hand's breadth; the wrist's, with what its plates bulge
  constexpr double kMostGirth = 3.45;
  constexpr double kElbowGirth = 0.93;                                         // of the greatest
  constexpr double kStartRound = kWristRadius / (kWristRadius + kWristAside);  // thickness over width
  constexpr double kMostRound = 0.86;
  const double widest = kWidest * hand.length;
  const double grown = smooth_step(std::clamp((behind - kHandStub) / (widest - kHandStub), 0.0, 1.0));
  const double fallen = smooth_step(std::clamp((behind - widest) / (kElbow * hand.length - widest), 0.0, 1.0));
  const double girth = std::lerp(kStartGirth, kMostGirth, grown) * std::lerp(1.0, kElbowGirth, fallen) * hand.breadth;
  const double aside_over_radius = 1.0 / std::lerp(kStartRound, kMostRound, grown) - 1.0;
  const double radius = girth / (2.0 * std::numbers::pi + 4.0 * aside_over_radius);
  return {radius, radius * aside_over_radius};
}

/// Plates from station to station, radii linear between them. Neighbours agree where they meet, so that no blend is
/// needed among them.
SoftPart forearm_flesh(const HandSkeleton& hand, double forearm) {
  constexpr double kStation = 8e-3;  // [m]
  SoftPart part;
  part.outward_blend = 0.05 * hand.breadth;
  const auto at = [&](double behind, double side) {
    return Vector3(side * forearm_section(hand, behind).aside, -behind, kWristHeight * hand.breadth);
  };
  const double end = kHandStub + forearm + kBeyondCut;
  const int stations = static_cast<int>(std::ceil((end - kHandStub) / kStation));
  for (int i = 0; i < stations; ++i) {
    const double from = kHandStub + (end - kHandStub) * i / stations;
    const double to = kHandStub + (end - kHandStub) * (i + 1) / stations;
    const double r = forearm_section(hand, from).radius;
    const double s = forearm_section(hand, to).radius;
    add_quad(part, {at(from, 1), at(to, 1), at(to, -1), at(from, -1)}, {r, s, s, r});
  }
  return part;
}

}  // namespace

SoftBody hand_flesh(const HandSkeleton& hand, double forearm) {
  std::vector<SoftPart> parts = {palm_flesh(hand), thumb_ball(hand), phalanges(hand.thumb, 1, hand.breadth)};
  for (std::size_t i = 0; i < 4; ++i) {
    const BoneChain& finger = hand.fingers[i];
    parts.push_back(finger_flesh(finger, hand.breadth));
    if (i > 0) {
      const BoneChain& neighbour = hand.fingers[i - 1];
      parts.push_back(web(neighbour, finger, hand));
    }
  }
  double rim = 12e-3;  // [m]
  if (forearm > 0) {
    parts.push_back(forearm_flesh(hand, forearm));
    rim +=
        2.0 * (forearm_section(hand, kHandStub + forearm).radius - kWristRadius * hand.breadth);  // rounder where wider
  }
  return SoftBody(std::move(parts), SoftCut{{0, -kHandStub - forearm, 0}, {0, -1, 0}, rim},
                  SoftFinish{kLeastHandGap, kHandGrid});
}

const std::vector<std::string>& hand_landmark_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const char* part : {"pad", "tip"}) {
      for (const char* digit : kDigits) {
        names.push_back(fmt::format("{}_{}", digit, part));
      }
    }
    names.insert(names.end(), {"palm_centre", "back_centre", "wrist"});
    return names;
  }();
  return kNames;
}

Vector3 landmark_on_skin(const HandSkeleton& skeleton, const SoftBody& flesh, const std::string& name) {
  for (std::size_t i = 0; i < kDigits.size(); ++i) {
    const BoneChain& chain = skeleton.digit(i);
    const double radius = 0.5 * (chain.radii[2] + chain.radii[3]);
    if (name == fmt::format("{}_pad", kDigits[i])) {
      return skin_of_digit(flesh, chain.along(2, 0.5), chain.palmar[2], radius);
    }
    if (name == fmt::format("{}_tip", kDigits[i])) {
      return skin_of_digit(flesh, chain.joints[3] - radius * chain.direction(2), chain.direction(2), radius);
    }
  }
  const auto from = [&](const Vector3& start, const Vector3& direction) {
    return Vector3(start + way_out(flesh, start, direction, skeleton.length) * direction);
  };
  const Vector3 palm(0, 0.2 * skeleton.length, -0.05 * skeleton.breadth);
  if (name == "palm_centre") {
    return from(palm, -Vector3::UnitZ());
  }
  if (name == "back_centre") {
    return from(palm, Vector3::UnitZ());
  }
  if (name == "wrist") {
    return from(Vector3::Zero(), -Vector3::UnitZ());
  }
  throw InputError(
      fmt::format("hand: unknown landmark '{}'; the landmarks are {}", name, fmt::join(hand_landmark_names(), ", ")));
}

}  // namespace touchfield
