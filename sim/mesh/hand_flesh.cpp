#include "sim/mesh/hand_flesh.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kStub = 20e-3;  // [m], of forearm behind the wrist joint

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

SoftPart palm(const HandSkeleton& hand) {
  const double b = hand.breadth;
  const double l = hand.length;
  SoftPart part;
  part.blend = 0.09 * b;
  // The flesh under the heads of the metacarpals lies towards the palm side of the joints.
  std::array<Vector3, 4> heads;
  for (std::size_t i = 0; i < 4; ++i) {
    heads[i] = hand.fingers[i].joints[0] + Vector3(0, -0.02 * l, -0.04 * b);
  }
  const std::array<double, 4> head_radii = {0.148 * b, 0.142 * b, 0.138 * b, 0.138 * b};
  const Vector3 carpus_thumb(0.15 * b, 0.07 * l, -0.03 * b);
  const Vector3 carpus_little(-0.19 * b, 0.07 * l, -0.04 * b);
  const double carpus = 0.175 * b;
  const Vector3 carpus_middle = 0.5 * (carpus_thumb + carpus_little);
  add_quad(part, {carpus_thumb, heads[0], heads[1], carpus_middle}, {carpus, head_radii[0], head_radii[1], carpus});
  add_quad(part, {carpus_middle, heads[1], heads[2], carpus_little}, {carpus, head_radii[1], head_radii[2], carpus});
  part.plates.push_back(plate(carpus_little, heads[2], heads[3], carpus, head_radii[2], head_radii[3]));
  // Wrist and forearm; the cut of the body ends them.
  const double wrist = 0.205 * b;
  const Vector3 wrist_thumb(0.125 * b, -0.01 * l, -0.01 * b);
  const Vector3 wrist_little(-0.135 * b, -0.01 * l, -0.01 * b);
  const Vector3 elbow(0, -3.0 * kStub, 0);
  add_quad(part, {carpus_thumb, wrist_thumb, wrist_little, carpus_little}, {carpus, wrist, wrist, carpus});
  add_quad(part, {wrist_thumb, wrist_thumb + elbow, wrist_little + elbow, wrist_little}, {wrist, wrist, wrist, wrist});
  // The ball of the little finger.
  part.cones.push_back({{-0.22 * b, 0.09 * l, -0.10 * b}, {-0.36 * b, 0.21 * l, -0.10 * b}, 0.15 * b, 0.125 * b});
  return part;
}

SoftPart thumb_ball(const HandSkeleton& hand) {
  const double b = hand.breadth;
  const BoneChain& thumb = hand.thumb;
  const Vector3 palm_middle(0.05 * b, 0.22 * hand.length, -0.07 * b);
  SoftPart part;
  part.blend = 0.06 * b;
  part.outward_blend = 0.12 * b;
  part.cones.push_back({thumb.joints[0], thumb.joints[1], thumb.radii[0], thumb.radii[1]});
  part.plates.push_back(plate(thumb.joints[0], thumb.along(0, 0.75), palm_middle, 0.16 * b, 0.125 * b, 0.12 * b));
  // The fold between thumb and index finger.
  part.plates.push_back(plate(thumb.along(0, 0.9),
                              hand.fingers[0].joints[0] + Vector3(0, -0.06 * hand.length, -0.05 * b), palm_middle,
                              0.07 * b, 0.09 * b, 0.09 * b));
  return part;
}

SoftPart phalanges(const BoneChain& chain, int first, double breadth) {
  SoftPart part;
  part.blend = 0.025 * breadth;
  part.outward_blend = 0.05 * breadth;
  for (int bone = first; bone < 3; ++bone) {
    const auto i = static_cast<std::size_t>(bone);
    Cone cone{chain.joints[i], chain.joints[i + 1], chain.radii[i], chain.radii[i + 1]};
    if (bone == 2) {
      cone.b -= chain.radii[3] * chain.direction(2);
    }
    part.cones.push_back(cone);
  }
  return part;
}

/// So far that its end turns back to its base.
bool curled(const BoneChain& finger) { return finger.direction(2).dot(finger.direction(0)) < -0.5; }

/// From a curled fingertip to within the palm.
Vector3 into_palm(double breadth) { return {0, 0, 0.15 * breadth}; }

/// A finger with the pad under its base; its inside is filled with flesh if it is curled.
SoftPart finger_flesh(const BoneChain& finger, double breadth) {
  SoftPart part = phalanges(finger, 0, breadth);
  part.cones.push_back({finger.joints[0] + 0.035 * breadth * finger.palmar[0],
                        finger.along(0, 0.5) + 0.01 * breadth * finger.palmar[0], 0.105 * breadth,
                        finger.radii[1] - 0.01 * breadth});
  if (curled(finger)) {
    part.outward_blend = 0.08 * breadth;
    const double radius = 0.75 * finger.radii[2];
    const Vector3 tip = finger.joints[3] - radius * finger.direction(2);
    add_quad(part, {finger.joints[0], finger.joints[1], finger.joints[2], tip}, {radius, radius, radius, radius});
    // The tip presses into the palm.
    const Vector3 pressed = tip + into_palm(breadth);
    part.plates.push_back(plate(finger.joints[0], tip, pressed, radius, radius, radius));
  }
  return part;
}

/// Two curled neighbours press their sides together; a groove stays between them.
SoftPart pressed_sides(const BoneChain& one, const BoneChain& other, double breadth) {
  SoftPart part;
  part.blend = part.outward_blend = 0.03 * breadth;
  for (std::size_t i = 0; i < 3; ++i) {
    const double start = 0.6 * std::min(one.radii[i], other.radii[i]);
    const double end = 0.6 * std::min(one.radii[i + 1], other.radii[i + 1]);
    add_quad(part, {one.joints[i], one.joints[i + 1], other.joints[i + 1], other.joints[i]}, {start, end, end, start});
  }
  const double tip = 0.6 * std::min(one.radii[3], other.radii[3]);
  const Vector3 inwards = into_palm(breadth);
  add_quad(part, {one.joints[3], other.joints[3], other.joints[3] + inwards, one.joints[3] + inwards},
           {tip, tip, tip, tip});
  return part;
}

struct Contact {
  bool pressed = false;
  double on_thumb = 0;   // how far along the thumb's last bone
  double on_finger = 0;  // and along the finger's middle one
};

/// Where the thumb's last segment lies nearest to a finger's middle one, and whether the two press on each other.
Contact contact(const BoneChain& thumb, const BoneChain& finger) {
  constexpr int kSteps = 20;
  constexpr double kSoft = 1.3;       // of the two radii: flesh gives way
  constexpr double kBeforeTip = 0.8;  // of the bone: its end is the round tip
  Contact nearest;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const double on_thumb = kBeforeTip * i / kSteps;
      const double on_finger = static_cast<double>(j) / kSteps;
      const double distance = (thumb.along(2, on_thumb) - finger.along(1, on_finger)).norm();
      if (distance < least) {
        least = distance;
        nearest = {distance < kSoft * (thumb.radii[3] + finger.radii[2]), on_thumb, on_finger};
      }
    }
  }
  return nearest;
}

/// The thumb laid over two curled fingers presses into the groove between them.
SoftPart thumb_press(const BoneChain& thumb, const BoneChain& one, const BoneChain& other, double breadth) {
  SoftPart part;
  part.outward_blend = 0.03 * breadth;
  const Contact first = contact(thumb, one);
  const Contact second = contact(thumb, other);
  if (first.pressed && second.pressed) {
    const double on_thumb = 0.6 * thumb.radii[3];
    const double on_finger = 0.6 * std::min(one.radii[2], other.radii[2]);
    add_quad(part,
             {thumb.along(2, first.on_thumb), thumb.along(2, second.on_thumb), other.along(1, second.on_finger),
              one.along(1, first.on_finger)},
             {on_thumb, on_thumb, on_finger, on_finger});
  }
  return part;
}

/// The skin between two fingers' bases.
SoftPart web(const BoneChain& one, const BoneChain& other, const HandSkeleton& hand) {
  constexpr double kReach = 0.34;  // of the proximal phalanx
  const double b = hand.breadth;
  SoftPart part;
  part.blend = 0.05 * b;
  part.outward_blend = 0.06 * b;
  const auto behind = [&](const BoneChain& finger) {
    return Vector3(finger.joints[0] + Vector3(0, -0.04 * hand.length, -0.03 * b));
  };
  const auto ahead = [&](const BoneChain& finger) {
    return Vector3(finger.along(0, kReach) + 0.01 * b * finger.palmar[0]);
  };
  add_quad(part, {behind(one), ahead(one), ahead(other), behind(other)}, {0.115 * b, 0.065 * b, 0.065 * b, 0.115 * b});
  return part;
}

}  // namespace

SoftBody hand_flesh(const HandSkeleton& hand) {
  std::vector<SoftPart> parts = {palm(hand), thumb_ball(hand), phalanges(hand.thumb, 1, hand.breadth)};
  for (std::size_t i = 0; i < 4; ++i) {
    const BoneChain& finger = hand.fingers[i];
    parts.push_back(finger_flesh(finger, hand.breadth));
    if (i > 0) {
      const BoneChain& neighbour = hand.fingers[i - 1];
      parts.push_back(web(neighbour, finger, hand));
      if (curled(neighbour) && curled(finger)) {
        parts.push_back(pressed_sides(neighbour, finger, hand.breadth));
        parts.push_back(thumb_press(hand.thumb, neighbour, finger, hand.breadth));
      }
    }
  }
  constexpr double kRim = 12e-3;  // [m]
  return SoftBody(std::move(parts), SoftCut{{0, -kStub, 0}, {0, -1, 0}, kRim});
}

}  // namespace touchfield
