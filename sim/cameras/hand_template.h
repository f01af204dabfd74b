#pragma once

#include <array>
#include <span>

#include "sim/cameras/deformation.h"
#include "sim/hand/hand_pose.h"
#include "sim/hand/skinned_hand.h"
#include "sim/mesh/topology.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/scene/body_spec.h"

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

/// A template's skin with proportions of its own and moved along its normals, in the template's pose.
struct ShapedHand {
  HandProportions proportions;
  Eigen::VectorXd offset;  // of each vertex along its normal, outwards [m]
  HandSkeleton skeleton;   // of the left hand
  Points rest;             // the vertices, in the hand's own frame [m]
  Points displacement;     // of each vertex by its offset [m]
};

/// The built-in hand as it is fitted to what cameras see. It is meshed in one pose. Its skeleton carries it to other
/// poses (SkinnedHand). Proportions (ShapeMap) and an offset along its normals carry it to other sizes. The vertices
/// lie on the hand's surface itself. Those of hand() lie off it by their faces' sagitta.
class HandTemplate {
 public:
  static constexpr double kUsualEdge = 4.5e-3;  // of a mesh that is fitted [m]

  /// hand   whose skin it is; parts that touch in its pose move only together
  /// edge   mean length of its edges [m]
  /// throws InputError as hand() does
  HandTemplate(const HandShape& hand, double edge);

  const HandShape& hand() const { return hand_; }
  const HandPose& pose() const { return pose_; }
  const TriangleMesh& mesh() const { return mesh_; }  // in the hand's own frame
  double side() const { return mirror_sign(hand_.side); }
  std::span<const SkinnedHand::Influence> influences(Eigen::Index vertex) const { return skin_.influences(vertex); }
  const FacesRound& faces_round() const { return round_; }

  /// 1 for joints that the fit may turn, 0 for those between parts that touch in the template.
  const JointAngles& free_joints() const { return free_; }

  /// offset   of each vertex, or empty for none
  ShapedHand shaped(const HandProportions& by, const Eigen::VectorXd& offset = {}) const;

  /// The skeleton of a shaped left hand with its joints at these angles.
  HandSkeleton skeleton_at(const HandProportions& by, const JointAngles& joints) const;

  /// The vertices of a shaped hand on a skeleton of its own, in the hand's frame. No memory is taken if `vertices` has
  /// their size.
  void carry(const ShapedHand& shape, const HandSkeleton& posed, Points& vertices) const {
    skin_.pose(shape.rest, shape.skeleton, posed, vertices);
  }

  /// How other points are bound to the template: of a finer mesh of the same hand, of a region, an anchor.
  struct Carrier {
    SkinnedHand skin;
    Points rest;          // [m], in the template's frame
    SkinBinding binding;  // to the nearest points of the template
  };
  /// points   on or near the template's skin, in its own frame [m]
  Carrier carrier(const Points& points) const;
  /// What carry() is of the template's vertices of the points that a carrier holds.
  void carry(const ShapedHand& shape, const HandSkeleton& posed, const Carrier& carrier, Points& points) const;

 private:
  HandTemplate(const HandShape& hand, const HandPose& pose, TriangleMesh mesh);
  Points shaped_points(const SkinnedHand& skin, const Points& points, const ShapeMap& map) const;

  HandShape hand_;
  HandPose pose_;
  HandSkeleton skeleton_;
  TriangleMesh mesh_;
  SkinnedHand skin_;
  JointAngles free_;
  FacesRound round_;
};

/// Unit normals of vertices: the mean of the faces round each, weighted by area.
void vertex_normals(const Points& vertices, const Triangles& triangles, Points& normals);

/// Joints whose turn moves parts that touch in a pose against each other: 0 in the row, others 1.
JointAngles joints_without_contact(const HandPose& pose, double length, double breadth);

}  // namespace touchfield
