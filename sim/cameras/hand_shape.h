#pragma once

#include <array>
#include <span>

#include "sim/hand/hand_pose.h"
#include "sim/hand/skinned_hand.h"

namespace touchfield {

/// How a hand differs in size from the built-in hand that it is fitted by: natural logarithms of ratios, all 0 for the
/// same hand.
///
///   0 length, 1 breadth (HandOptions), 2 thickness of the palm, 3 to 7 thickness of the digits from thumb to little,
///   8 to 12 length of their bones; 2 to 12 besides what length and breadth make of them
using HandProportions = Eigen::Matrix<double, 13, 1>;

inline constexpr Eigen::Index kLengthRatio = 0;
inline constexpr Eigen::Index kBreadthRatio = 1;
inline constexpr Eigen::Index kPalmRatio = 2;
inline constexpr Eigen::Index kGirthRatios = 3;
inline constexpr Eigen::Index kDigitRatios = 8;

/// The bones of such a hand in a pose.
///
/// length, breadth   of the hand that the proportions are relative to [m]
HandSkeleton proportioned_skeleton(const HandPose& pose, double length, double breadth, const HandProportions& by);

/// What proportions do to the skin in the pose that it was meshed in. Each bone b has an affine map of its own. It
/// stretches along the bone by the ratio of its lengths, and across by the breadth and its digit's thickness:
///
///   A_b(x) = j'_b + F_b' diag(g, l, g) F_b^T (x - j_b)   (F across, along, palmwards; j its joint)
///
/// The map of the palm is diag(breadth, length, breadth thickness). A vertex moves to sum_b w_b A_b(x), with
/// SkinnedHand's weights. A joint lies where both of its bones have it, so that nothing tears.
class ShapeMap {
 public:
  /// made_in   the template's skeleton; `of` the same pose's with the proportions
  ShapeMap(const HandSkeleton& made_in, const HandSkeleton& of, const HandProportions& by);

  /// Of a left hand.
  Vector3 operator()(const Vector3& x, std::span<const SkinnedHand::Influence> influences) const;

 private:
  std::array<RigidMotion, SkinnedHand::kBones> maps_;  // affine, not rigid
};

}  // namespace touchfield
