#include "sim/cameras/hand_shape.h"

#include <cmath>

#include <Eigen/Geometry>

namespace touchfield {

HandSkeleton proportioned_skeleton(const HandPose& pose, double length, double breadth, const HandProportions& by) {
  HandSkeleton skeleton =
      posed_skeleton(pose, length * std::exp(by(kLengthRatio)), breadth * std::exp(by(kBreadthRatio)));
  for (std::size_t d = 0; d < HandSkeleton::kDigits; ++d) {
    BoneChain& chain = d == 0 ? skeleton.thumb : skeleton.fingers[d - 1];
    const BoneChain before = chain;
    const double stretch = std::exp(by(kDigitRatios + static_cast<Eigen::Index>(d)));
    const double girth = std::exp(by(kGirthRatios + static_cast<Eigen::Index>(d)));
    for (std::size_t i = 0; i < 3; ++i) {
      chain.joints[i + 1] = chain.joints[i] + stretch * (before.joints[i + 1] - before.joints[i]);
    }
    for (double& radius : chain.radii) {
      radius *= girth;
    }
  }
  return skeleton;
}

namespace {

Eigen::Matrix3d bone_frame(const BoneChain& chain, std::size_t bone) {
  Eigen::Matrix3d frame;
  frame.col(1) = chain.direction(static_cast<int>(bone));
  frame.col(2) = chain.palmar[bone];
  frame.col(0) = frame.col(1).cross(frame.col(2));
  return frame;
}

double bone_length(const BoneChain& chain, std::size_t bone) {
  return (chain.joints[bone + 1] - chain.joints[bone]).norm();
}

}  // namespace

ShapeMap::ShapeMap(const HandSkeleton& made_in, const HandSkeleton& of, const HandProportions& by) {
  const double broad = std::exp(by(kBreadthRatio));
  RigidMotion& palm = maps_[SkinnedHand::kPalm];
  palm.rotation = Vector3(broad, std::exp(by(kLengthRatio)), broad * std::exp(by(kPalmRatio))).asDiagonal();
  for (std::size_t d = 0; d < HandSkeleton::kDigits; ++d) {
    const BoneChain& from = made_in.digit(d);
    const BoneChain& to = of.digit(d);
    const double across = broad * std::exp(by(kGirthRatios + static_cast<Eigen::Index>(d)));
    for (std::size_t bone = 0; bone < 3; ++bone) {
      const Vector3 stretch(across, bone_length(to, bone) / bone_length(from, bone), across);
      RigidMotion& map = maps_[SkinnedHand::bone_number(d, bone)];
      map.rotation = bone_frame(to, bone) * stretch.asDiagonal() * bone_frame(from, bone).transpose();
      map.shift = to.joints[bone] - map.rotation * from.joints[bone];
    }
  }
  maps_[SkinnedHand::kSwing] = maps_[SkinnedHand::bone_number(0, 0)];
}

Vector3 ShapeMap::operator()(const Vector3& x, std::span<const SkinnedHand::Influence> influences) const {
  Vector3 sum = Vector3::Zero();
  for (const SkinnedHand::Influence& one : influences) {
    sum += one.weight * maps_[one.bone](x);
  }
  return sum;
}

}  // namespace touchfield
