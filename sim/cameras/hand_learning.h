#pragma once

#include <vector>

#include "sim/cameras/pose_fit.h"

namespace touchfield {

/// What is expected of a hand's shape before it is seen, and how it is learnt.
struct LearningOptions {
  double size = 0.08;         // deviation of length and breadth, as a ratio
  double part = 0.05;         // of the thickness of the palm and of digits, and of the digits' lengths
  double offset = 1.5e-3;     // of the offset along the normals [m]
  double roughness = 0.1e-3;  // of the offset's difference from its mean round a vertex [m]
  int rounds = 8;             // for proportions and poses together
  int offset_rounds = 3;      // for the offset and then the poses
};

/// Learns the shape of a hand from what was seen of it in several poses.
///
/// First the proportions and the poses of all frames are fitted together. This is Gauss-Newton on PoseFit's sum over
/// the frames and sum_k (b_k / deviation_k)^2. The poses are eliminated frame by frame. Where the template cannot make
/// the hand, the points lie farther off it than their noise. The same places do so in all frames, so that the points
/// weigh less against what is expected. Then the offset o of the vertices along their normals is fitted, and the poses
/// again:
///
///   sum_frames sum_i w_i (r_i - sum_c b_ic o_c)^2 + sum_v (o_v / offset)^2 + sum_v ((o_v - mean_round o) /
///   roughness)^2
///
/// The matrix of this sum is sparse (Cholesky). The offset of skin that is not seen follows smoothly that of the skin
/// next to it and falls to 0.
///
/// start    shape to start from
/// frames   points of each; one or more
/// states   of the hand in each, near enough for matches within 15 mm; improved
ShapedHand learnt_shape(const HandTemplate& hand, const ShapedHand& start, const std::vector<HandPoints>& frames,
                        std::vector<HandState>& states, const LearningOptions& options = {});

}  // namespace touchfield
