#include "sim/hand/hand_landmarks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

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

/// The skin nearest to a point inside the flesh.
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
