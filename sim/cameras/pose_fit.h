#pragma once

#include <array>
#include <vector>

#include "sim/cameras/hand_template.h"
#include "sim/cameras/seen_skin.h"
#include "sim/cameras/vertex_grid.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/types.h"

namespace touchfield {

/// Where a hand is, from its own frame to the world's, and how its joints stand.
struct HandState {
  RigidMotion place;
  JointAngles joints;  // [rad]
};

/// The unknowns of a pose: a small turn [rad] about a centre and shift [m] of the place, then the joints.
inline constexpr Eigen::Index kPlaceUnknowns = 6;
inline constexpr Eigen::Index kPoseUnknowns = kPlaceUnknowns + JointAngles::SizeAtCompileTime;
using PoseVector = Eigen::Matrix<double, kPoseUnknowns, 1>;
using PoseMatrix = Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns>;

/// x -> R(turn) (x - centre) + centre + shift after the place, and the joints turned.
HandState moved(const HandState& state, const PoseVector& by, const Vector3& centre);

/// What is expected of the joints before any point is seen.
struct PosePrior {
  JointAngles joints;     // [rad]
  JointAngles deviation;  // [rad]
};

struct PoseFitOptions {
  int rounds = 5;
  double first_reach = 8e-3;  // how far from the skin points are looked for in the first round [m], ...
  double reach = 8e-3;        // and in the end; halved from round to round in between
  double scale = 3e-3;        // m of the robust weights [m]; no less than a third of the reach of the round
  int stride = 1;             // each how many-th point is used
  bool place_only = false;    // joints stay
};

/// A point and where the skin has it.
struct SkinMatch {
  int point;
  int face;         // of the template
  int vertex;       // its corner with the largest weight
  Vector3 weights;  // of the face's corners at the nearest point
  Vector3 normal;   // of the smooth skin there, in the world's frame
  double residual;  // distance of the point from the smooth skin, positive outside [m]
  double weight;    // in the sum of squares [1/m2]
};

struct PoseFitResult {
  HandState state;
  double residual = 0;   // rms of the matched points' distances, robustly weighted [m]
  double explained = 0;  // share of the points within three of their deviations and 1 mm of the skin
};

/// Of the template's skin, rms [m]: of a shape that was learnt, and from that of any hand.
inline constexpr double kKnownSkinError = 0.3e-3;
inline constexpr double kUnknownSkinError = 1.5e-3;

/// Fits a hand's pose to points of its skin: Levenberg and Marquardt on
///
///   sum_i rho(r_i) / (c s_i^2) + sum_j ((q_j - prior_j) / deviation_j)^2,   rho(r) = r^2 / (1 + (r / m)^2)
///
/// r_i is the distance of point i from the smooth skin, along the normal at the nearest point of the face nearest to
/// it. s_i^2 is the point's variance and that of the skin's model (0.3 mm for a shape that is known). c = 8 is for
/// points that err together, m is the scale. The smooth skin passes through the vertices and has their normals n_k.
/// With weights b_k of the corners x_k at the foot,
///
///   r = (n . (p - sum b_k x_k) + sum b_k n_k . (p - x_k)) / 2,   n = sum b_k n_k / |..|
///
/// which is exact to second order. Matches are made again in each round (VertexGrid). The last 12 mm of the skin match
/// nothing, since an arm continues there. Joints are held in their ranges and 10 degrees more.
///
/// The derivatives are those of linear blending of the bones' motions: SkinnedHand's but for the bulge at joints.
class PoseFit {
 public:
  /// hand   kept by reference: it must outlive this
  explicit PoseFit(const HandTemplate& hand);
  PoseFit(HandTemplate&&) = delete;

  /// How far the skin is expected to be from that of the shape [m], rms.
  void expect_model_error(double error) { model_error_ = error; }
  double model_error() const { return model_error_; }
  /// m of the robust weights that goes with it [m].
  double robust_scale() const { return 1.6e-3 + 1.6 * model_error_; }

  PoseFitResult fit(const ShapedHand& shape, const HandPoints& points, const HandState& start, const PosePrior& prior,
                    const PoseFitOptions& options = {});

  /// Places the skin of a state: vertices() and normals() are then its.
  void place_skin(const ShapedHand& shape, const HandState& state);
  /// Matches points with the skin that was placed last; matches() and rows() are then its.
  /// returns   the sum of robust squares, points without a match counted with the most that rho can be
  double match_placed(const HandPoints& points, double reach, double scale, int stride = 1);
  /// place_skin, then match_placed.
  double match(const ShapedHand& shape, const HandPoints& points, const HandState& state, double reach, double scale,
               int stride = 1);
  /// Derivatives of what the last match() found.
  void differentiate(const ShapedHand& shape, const HandState& state, const Vector3& centre);

  const Points& vertices() const { return vertices_; }  // 3 x V, in the world's frame [m]
  const Points& normals() const { return normals_; }    // of the vertices
  const std::vector<SkinMatch>& matches() const { return matches_; }
  /// How far the skin moves along the normal of each match for each unknown, one column per match.
  auto rows() const { return rows_.leftCols(static_cast<Eigen::Index>(matches_.size())); }

 private:
  using Twists = Eigen::Matrix<double, 6, 5>;  // of a bone for its digit's joints: turn, and shift of the origin

  struct Equations {
    PoseMatrix curvature = PoseMatrix::Zero();  // half of the second derivative
    PoseVector slope = PoseVector::Zero();      // half of the first, downwards
    double residual = 0;                        // as PoseFitResult
    double explained = 0;
  };

  Equations equations(const HandPoints& points, int stride);
  class Descent;
  bool match_point(const HandPoints& points, int i, int vertex, SkinMatch& match) const;
  void twist_bones(const ShapedHand& shape, const HandState& state);

  const HandTemplate& hand_;
  JointAngles least_;
  JointAngles most_;
  double model_error_ = kKnownSkinError;
  double end_;  // y in the template's frame [m]: skin behind it matches nothing
  Points vertices_;
  Points normals_;
  VertexGrid grid_;
  std::vector<SkinMatch> matches_;
  std::array<Twists, SkinnedHand::kBones> twists_;
  Eigen::Matrix<double, kPoseUnknowns, Eigen::Dynamic> rows_;
  Eigen::Matrix<double, kPoseUnknowns, Eigen::Dynamic> weighted_;
};

}  // namespace touchfield
