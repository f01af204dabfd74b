#include "sim/cameras/pose_fit.h"

#include <gtest/gtest.h>

#include "tests/support/moving_hand_support.h"

namespace touchfield::pose_fit_test {

const HandTemplate& fitted_hand(HandSide side = HandSide::kRight) {
  const auto made = [](HandSide of) {
    HandShape hand{.forearm = 0};
    hand.pose = "flat";
    hand.side = of;
    return HandTemplate(hand, 5e-3);
  };
  static const HandTemplate right = made(HandSide::kRight);
  static const HandTemplate left = made(HandSide::kLeft);
  return side == HandSide::kRight ? right : left;
}

HandState some_state(const HandTemplate& hand) {
  HandState state{{extrinsic_rotation(Vector3(10, -15, 30) * kDegree), Vector3(0.02, -0.05, 0.2)},
                  joint_angles(hand.pose())};
  state.joints(5) += 4 * kDegree;
  state.joints(6) += 12 * kDegree;
  state.joints(7) += 15 * kDegree;
  state.joints(8) += 8 * kDegree;
  state.joints(15) += 10 * kDegree;
  state.joints(3) += 8 * kDegree;
  state.joints(4) += 10 * kDegree;
  return state;
}

/// All of its skin but the end at the wrist, which matches nothing; each point a third of a face away from a vertex.
HandPoints points_of(const HandTemplate& hand, const HandState& state) {
  const ShapedHand shape = hand.shaped(HandProportions::Zero());
  Points vertices;
  hand.carry(shape, hand.skeleton_at(shape.proportions, state.joints), vertices);
  const TriangleMesh mesh(state.place(vertices), hand.mesh().triangles());
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (hand.mesh().centroids()(1, f) > hand.mesh().vertices().row(1).minCoeff() + 15e-3) {
      faces.push_back(f);
    }
  }
  HandPoints points;
  points.at = mesh.centroids()(Eigen::all, faces);
  points.normal = mesh.normals()(Eigen::all, faces);
  points.camera.assign(faces.size(), 0);
  points.sigma.setConstant(points.at.cols(), 0.1e-3);
  return points;
}

PosePrior loose(const HandState& state) { return {state.joints, JointAngles::Constant(60 * kDegree)}; }

TEST(PoseFit, DerivativesAreThoseOfDifferences) {
  for (const HandSide side : {HandSide::kRight, HandSide::kLeft}) {
    const HandTemplate& hand = fitted_hand(side);
    const ShapedHand shape = hand.shaped(HandProportions::Constant(0.02));
    const HandState state = some_state(hand);
    const HandPoints points = points_of(hand, state);
    const Vector3 centre = points.at.rowwise().mean();
    PoseFit fit(hand);
    fit.match(shape, points, state, 8e-3, 2e-3);
    fit.differentiate(shape, state, centre);
    ASSERT_GT(fit.matches().size(), 0.95 * static_cast<double>(points.size()));
    const Points before = fit.vertices();
    const std::vector<SkinMatch> matches = fit.matches();
    const Eigen::MatrixXd rows = fit.rows();
    for (Eigen::Index k = 0; k < kPoseUnknowns; ++k) {
      constexpr double kStep = 1e-5;
      const HandState after = moved(state, kStep * PoseVector::Unit(k), centre);
      Points vertices;
      hand.carry(shape, hand.skeleton_at(shape.proportions, after.joints), vertices);
      vertices = after.place(vertices);
      double off = 0;
      double size = 0;
      for (std::size_t m = 0; m < matches.size(); ++m) {
        const auto face = hand.mesh().triangles().col(matches[m].face);
        const Vector3 moved_by = (vertices(Eigen::all, face) - before(Eigen::all, face)) * matches[m].weights / kStep;
        const double expected = matches[m].normal.dot(moved_by);
        off += std::pow(rows(k, static_cast<Eigen::Index>(m)) - expected, 2);
        size += expected * expected;
      }
      // Exact for the place; linear blending, and one corner's weights for a face's, for the joints.
      EXPECT_LT(std::sqrt(off / size), k < kPlaceUnknowns ? 1e-4 : 0.2) << "unknown " << k;
    }
  }
}

TEST(PoseFit, FindsTheExactPoseOfExactPoints) {
  for (const HandSide side : {HandSide::kRight, HandSide::kLeft}) {
    const HandTemplate& hand = fitted_hand(side);
    const ShapedHand shape = hand.shaped(HandProportions::Zero());
    const HandState truth = some_state(hand);
    const HandPoints points = points_of(hand, truth);
    HandState start = truth;
    start.joints = joint_angles(hand.pose());
    start.place.rotation = extrinsic_rotation(Vector3(2, -3, 3) * kDegree) * start.place.rotation;
    start.place.shift += Vector3(4e-3, -5e-3, 6e-3);
    PoseFit fit(hand);
    const PoseFitResult result = fit.fit(shape, points, start, loose(start), {20, 20e-3, 6e-3, 2e-3, 1, false});
    const HandState& found = result.state;
    EXPECT_GT(result.explained, 0.99);
    EXPECT_LT(result.residual, 0.3e-3) << "the faces' middles lie below the smooth skin";
    Points one;
    Points other;
    hand.carry(shape, hand.skeleton_at(shape.proportions, truth.joints), one);
    hand.carry(shape, hand.skeleton_at(shape.proportions, found.joints), other);
    // Those at the fingertips lie below it too, and no end at the wrist holds against them.
    EXPECT_LT((truth.place(one) - found.place(other)).colwise().norm().mean(), 0.4e-3);
    for (const int joint : {6, 7, 8, 15}) {
      EXPECT_NEAR(found.joints(joint), truth.joints(joint), 1 * kDegree) << joint;
    }
  }
}

TEST(PoseFit, JointsStayInTheirRanges) {
  const HandTemplate& hand = fitted_hand();
  const ShapedHand shape = hand.shaped(HandProportions::Zero());
  HandState state = some_state(hand);
  state.joints(7) = -40 * kDegree;
  const HandPoints points = points_of(hand, state);
  HandState start = state;
  start.joints(7) = 0;
  PoseFit fit(hand);
  const HandState found = fit.fit(shape, points, start, loose(start), {15, 25e-3, 25e-3, 8e-3, 1, false}).state;
  EXPECT_LT(found.joints(7), 0);
  EXPECT_GE(found.joints(7), (0 - 10) * kDegree - 1e-12);
}

}  // namespace touchfield::pose_fit_test
