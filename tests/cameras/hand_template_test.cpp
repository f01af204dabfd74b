#include "sim/cameras/hand_template.h"

#include <gtest/gtest.h>

#include "sim/hand/hand_flesh.h"
#include "sim/mesh/query/face_tree.h"
#include "tests/support/hand_support.h"
#include "tests/support/moving_hand_support.h"

namespace touchfield::hand_template_test {

constexpr double kTemplateEdge = 5e-3;

HandShape hand_in(const std::string& pose) {
  HandShape hand{.forearm = 0};
  hand.pose = pose;
  return hand;
}

const HandTemplate& flat_template() {
  static const HandTemplate hand(hand_in("flat"), kTemplateEdge);
  return hand;
}

HandProportions some_proportions() {
  HandProportions by;
  by << 0.05, -0.06, 0.04, 0.03, -0.05, 0.06, 0.04, -0.06, 0.04, -0.05, 0.04, 0.03, -0.05;
  return by;
}

Eigen::VectorXd some_offset(const Points& rest) {
  return (0.5e-3 * (100 * rest.row(0) + 60 * rest.row(1)).array().sin()).matrix().transpose();
}

JointAngles bent(const HandPose& pose) {
  JointAngles joints = joint_angles(pose);
  joints(6) += 20 * kDegree;
  joints(7) += 30 * kDegree;
  joints(11) += 10 * kDegree;
  joints(3) += 12 * kDegree;
  return joints;
}

TEST(HandTemplate, ItsVerticesLieOnTheHandItself) {
  const HandTemplate& hand = flat_template();
  const SoftBody flesh = hand_flesh(posed_skeleton(hand.pose(), hand.hand().length, hand.hand().breadth));
  const Points vertices = mirrored(hand.mesh().vertices());  // the flesh is a left hand's
  Eigen::Index off = 0;
  for (const auto& x : vertices.colwise()) {
    off += std::abs(flesh.distance(x)) > 1e-6 ? 1 : 0;
  }
  EXPECT_LT(static_cast<double>(off), 0.01 * static_cast<double>(hand.mesh().vertex_count()));
}

TEST(HandTemplate, CarriesAFinerMeshBesideItsOwn) {
  const HandTemplate& hand = flat_template();
  const TriangleMesh finer = touchfield::hand(hand_options(hand.hand(), 3e-3)).mesh;
  const HandTemplate::Carrier carrier = hand.carrier(finer.vertices());
  const ShapedHand shape = hand.shaped(some_proportions(), some_offset(hand.mesh().vertices()));
  const HandSkeleton posed = hand.skeleton_at(shape.proportions, bent(hand.pose()));
  Points vertices;
  Points carried;
  hand.carry(shape, posed, vertices);
  hand.carry(shape, posed, carrier, carried);
  const FaceTree tree(TriangleMesh(vertices, hand.mesh().triangles()));
  double squares = 0;
  for (const auto& x : carried.colwise()) {
    const double distance = tree.nearest(x).distance;
    EXPECT_LT(distance, 1.5e-3);
    squares += distance * distance;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(carried.cols())), 0.3e-3);
}

/// The built-in hand of another size, meshed by itself.
TEST(HandTemplate, LengthAndBreadthAreThoseOfTheBuiltInHand) {
  const HandTemplate& hand = flat_template();
  HandShape other = hand.hand();
  other.length = 0.93 * hand.hand().length;
  other.breadth = 0.92 * hand.hand().breadth;
  HandProportions by = HandProportions::Zero();
  by(kLengthRatio) = std::log(0.93);
  by(kBreadthRatio) = std::log(0.92);
  const SoftBody flesh = hand_flesh(posed_skeleton(hand.pose(), other.length, other.breadth));
  const auto rms_of = [&](const Points& right) {
    const Points points = mirrored(right);
    double squares = 0;
    for (const auto& x : points.colwise()) {
      squares += std::pow(flesh.distance(x), 2);
    }
    return std::sqrt(squares / static_cast<double>(points.cols()));
  };
  EXPECT_LT(rms_of(hand.shaped(by).rest), 0.35e-3);
  EXPECT_GT(rms_of(hand.mesh().vertices()), 2e-3);
}

TEST(HandTemplate, TheLeftHandIsTheMirrorImage) {
  HandShape left = hand_in("flat");
  left.side = HandSide::kLeft;
  const HandTemplate mirrored(left, kTemplateEdge);
  const HandTemplate& hand = flat_template();
  const Eigen::VectorXd offset = some_offset(hand.mesh().vertices());
  const ShapedHand one = hand.shaped(some_proportions(), offset);
  const ShapedHand other = mirrored.shaped(some_proportions(), offset);
  Points right_points;
  Points left_points;
  hand.carry(one, hand.skeleton_at(one.proportions, bent(hand.pose())), right_points);
  mirrored.carry(other, mirrored.skeleton_at(other.proportions, bent(hand.pose())), left_points);
  left_points.row(0) *= -1;
  EXPECT_LT((right_points - left_points).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace touchfield::hand_template_test
