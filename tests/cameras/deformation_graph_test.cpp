#include <random>

#include "sim/cameras/deformation.h"
#include "sim/core/rigid_motion.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "tests/support/random_support.h"
#include "tests/support/testing.h"

namespace touchfield::deformation_graph_test {

const Body& flat_hand() {
  static const Body kHand = hand({.pose = "flat", .edge = 5e-3});
  return kHand;
}

const DeformationGraph& flat_graph() {
  static const DeformationGraph kGraph(flat_hand().mesh, 14e-3);
  return kGraph;
}

RigidMotion some_motion(unsigned seed) {
  std::mt19937 random(seed);
  return {some_rotation(random), 0.1 * point_in_cube(random)};
}

NodeMotions moved_rigidly(const DeformationGraph& graph, const Points& vertices, const RigidMotion& motion) {
  NodeMotions motions = graph.motions(vertices, {});
  motions.shift = motion(motions.at) - motions.at;
  graph.turn(motions);
  return motions;
}

TEST(DeformationGraph, CarriesARigidMotionExactly) {
  const DeformationGraph& graph = flat_graph();
  const RigidMotion motion = some_motion(1);
  const Points vertices = flat_hand().mesh.vertices();
  const NodeMotions motions = moved_rigidly(graph, vertices, motion);
  for (const Eigen::Matrix3d& turn : motions.turn) EXPECT_LT((turn - motion.rotation).norm(), 1e-10);
  Points moved = vertices;
  graph.apply(motions, moved);
  EXPECT_LT((moved - motion(vertices)).cwiseAbs().maxCoeff(), 1e-12);

  std::mt19937 random(2);
  Points near(3, 200);
  for (auto point : near.colwise()) {
    point = vertices.col(static_cast<Eigen::Index>(uniform(random, 0, 1) * static_cast<double>(vertices.cols()))) +
            2e-3 * point_in_cube(random);
  }
  Points carried = near;
  graph.apply(motions, bound(flat_hand().mesh, near), carried);
  EXPECT_LT((carried - motion(near)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(DeformationGraph, ShiftsFollowTheSkin) {
  const DeformationGraph& graph = flat_graph();
  std::mt19937 random(4);
  Points shifts(3, graph.node_count());
  for (auto shift : shifts.colwise()) shift = 2e-3 * point_in_cube(random);
  const Points vertices = flat_hand().mesh.vertices();
  const NodeMotions motions = graph.motions(vertices, shifts);
  EXPECT_LT((DeformationGraph::shifts(motions) - shifts).cwiseAbs().maxCoeff(), 1e-15);
  const RigidMotion motion = some_motion(5);
  Points first = vertices;
  graph.apply(motions, first);
  Points then = motion(vertices);
  graph.apply(graph.motions(then, shifts), then);
  EXPECT_LT((then - motion(first)).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(DeformationGraph, FingersDoNotMoveEachOther) {
  const DeformationGraph& graph = flat_graph();
  const TriangleMesh& mesh = flat_hand().mesh;
  const Vector3 tip = position(mesh, find_landmark(flat_hand(), "index_tip"));
  const Vector3 other = position(mesh, find_landmark(flat_hand(), "middle_tip"));
  NodeMotions motions = graph.motions(mesh.vertices(), {});
  // All nodes of the finger's last 45 mm, whatever is beside it.
  for (Eigen::Index i = 0; i < graph.node_count(); ++i) {
    const Vector3 at = motions.at.col(i);
    const bool nearer = (at - tip).head<1>().norm() < (at - other).head<1>().norm();
    if (nearer && (at - tip).norm() < 45e-3) motions.shift.col(i).setConstant(5e-3);
  }
  graph.turn(motions);
  Points vertices = mesh.vertices();
  graph.apply(motions, vertices);
  const Eigen::ArrayXd moved = (vertices - mesh.vertices()).colwise().norm();
  int still = 0;
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    const Vector3 at = mesh.vertices().col(v);
    if ((at - other).norm() < 40e-3 && std::abs(at.x() - other.x()) < 6e-3) {
      EXPECT_LT(moved(v), 1e-15);
      ++still;
    }
    if ((at - tip).norm() < 8e-3) {
      EXPECT_NEAR(moved(v), 5e-3 * std::sqrt(3.0), 1e-12);
    }
  }
  EXPECT_GT(still, 50);
}

}  // namespace touchfield::deformation_graph_test
