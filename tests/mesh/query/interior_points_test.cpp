#include "sim/mesh/query/interior_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"

namespace touchfield::interior_points_test {

using std::numbers::pi;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kSeparation = 0.8;  // spacings, as the header says

double least_distance(const Points& points) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 1; i < points.cols(); ++i) {
    least = std::min(least, (points.leftCols(i).colwise() - points.col(i)).colwise().norm().minCoeff());
  }
  return least;
}

/// Built once: it takes longer than the tests.
const Body& pointing_hand() {
  static const Body body = hand({.pose = "index_up", .edge = 4e-3});
  return body;
}

/// Distance from each point to the nearest point of the skin [m].
Eigen::VectorXd depths(const TriangleMesh& mesh, const Points& points) {
  const FaceTree tree(mesh);
  Eigen::VectorXd result(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    result(i) = tree.nearest(points.col(i)).distance;
  }
  return result;
}

/// Distance from the axis of a capsule along y with this cylinder length.
double from_axis(const Vector3& x, double length) {
  return (x - Vector3(0, std::clamp(x.y(), -length / 2, length / 2), 0)).norm();
}

TEST(Depths, OfABoxAreKnown) {
  const Vector3 half(0.01, 0.015, 0.02);
  const TriangleMesh mesh = box(2.0 * half, 3e-3).mesh;
  Points points(3, 5);
  points << 0, 0.004, 0.009, 0.02, 0.013,  //
      0, 0.012, 0.001, 0.0, 0.019,         //
      0, 0.005, -0.002, 0.0, 0.01;
  Eigen::VectorXd expected(5);
  expected << 0.01, 0.003, 0.001, 0.01, 0.005;  // the last is off an edge by 3 and 4 mm
  EXPECT_LT((depths(mesh, points) - expected).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(SpacedInteriorPoints, KeepClearanceAndSpacingInTheSphere) {
  const double radius = 0.03;
  const double sagitta = 1e-4;  // (3 mm)^2 / (8 * 30 mm) = 0.04 mm
  const TriangleMesh mesh = sphere(radius, 3e-3).mesh;
  const Points points = spaced_interior_points(mesh, 5e-3, 4e-3);
  ASSERT_GT(points.cols(), 0);
  EXPECT_LT(points.colwise().norm().maxCoeff(), radius - 4e-3 + sagitta);
  EXPECT_GE(depths(mesh, points).minCoeff(), 4e-3 * (1 - 1e-12));
  EXPECT_GE(least_distance(points), kSeparation * 5e-3);
}

TEST(SpacedInteriorPoints, KeepClearanceInTheBox) {
  const Vector3 half(0.01, 0.02, 0.03);
  const Points points = spaced_interior_points(box(2.0 * half, 4e-3).mesh, 3e-3, 2.5e-3);
  ASSERT_GT(points.cols(), 0);
  EXPECT_LE((points.cwiseAbs().colwise() - half).maxCoeff(), -2.5e-3 * (1 - 1e-12));
  EXPECT_GE(least_distance(points), kSeparation * 3e-3);
}

TEST(SpacedInteriorPoints, KeepAShareOfTheNearestEdge) {
  const TriangleMesh mesh = sphere(0.03, 6e-3).mesh;
  const Points points = spaced_interior_points(mesh, 5e-3, 1e-3, 0.75);
  const double smallest = std::sqrt(4.0 / std::sqrt(3.0) * mesh.areas().minCoeff());
  ASSERT_GT(points.cols(), 0);
  EXPECT_GE(depths(mesh, points).minCoeff(), 0.75 * smallest);
  EXPECT_GT(spaced_interior_points(mesh, 5e-3, 1e-3).cols(), points.cols());
}

TEST(SpacedInteriorPoints, FillAFingerAlongItsLength) {
  const double length = 0.06;
  const Points points = spaced_interior_points(capsule(8e-3, length, 2.5e-3).mesh, 3.5e-3, 2.5e-3);
  for (const Vector3 x : points.colwise()) {
    EXPECT_LT(from_axis(x, length), 8e-3 - 2.5e-3 + 0.15e-3);  // the vertices stand off by their sagitta, 0.1 mm
  }
  // The core of 5.5 mm holds a ball of 0.87 spacings everywhere: a point within 1.67 spacings along the axis.
  for (double y = -length / 2; y <= length / 2; y += 1e-3) {
    EXPECT_LT((points.colwise() - Vector3(0, y, 0)).colwise().norm().minCoeff(), 1.67 * 3.5e-3);
  }
}

TEST(SpacedInteriorPoints, ReachEveryFingerOfTheHand) {
  const Body& body = pointing_hand();
  const Points points = spaced_interior_points(body.mesh, 3.5e-3, 2.5e-3);
  EXPECT_GE(depths(body.mesh, points).minCoeff(), 2.5e-3 * (1 - 1e-12));
  EXPECT_GE(least_distance(points), kSeparation * 3.5e-3);
  for (const Landmark& landmark : body.landmarks) {
    // A point under each pad and tip: no farther than the clearance, a ball's radius and the 1.67 spacings together.
    const Vector3 skin = position(body.mesh, landmark);
    EXPECT_LT((points.colwise() - skin).colwise().norm().minCoeff(), 2.5e-3 + (0.87 + 1.67) * 3.5e-3) << landmark.name;
  }
  // Inside by another criterion: the nearest centroid's normal points away.
  const Eigen::Index wrong = std::count_if(points.colwise().begin(), points.colwise().end(), [&](const auto& x) {
    Eigen::Index face = 0;
    (body.mesh.centroids().colwise() - x).colwise().squaredNorm().minCoeff(&face);
    return body.mesh.normals().col(face).dot(body.mesh.centroids().col(face) - x) <= 0;
  });
  EXPECT_EQ(wrong, 0);
}

// One point a spacing cubed in the bulk: the balls of a random packing at 0.8 spacings fill 0.27 of the space.
TEST(SpacedInteriorPoints, NumberFollowsTheVolume) {
  const double radius = 0.04;
  const TriangleMesh mesh = sphere(radius, 3e-3).mesh;
  for (const double spacing : {3e-3, 4e-3, 6e-3}) {
    const auto count = static_cast<double>(spaced_interior_points(mesh, spacing, 3e-3).cols());
    const double expected = 4.0 / 3.0 * pi * std::pow((radius - 3e-3) / spacing, 3);
    EXPECT_NEAR(count / expected, 1.0, 0.25) << spacing;
  }
}

TEST(SpacedInteriorPoints, FillEveryPiece) {
  const TriangleMesh mesh = together(sphere(0.02, 3e-3).mesh, shifted(sphere(0.01, 3e-3).mesh, {0.05, 0, 0}));
  const Points points = spaced_interior_points(mesh, 4e-3, 2e-3);
  const Eigen::Index first = (points.row(0).array() < 0.03).count();
  const Eigen::Index second = points.cols() - first;
  // Radii of 18 and 8 mm have the clearance.
  EXPECT_NEAR(static_cast<double>(first), 4.0 / 3.0 * pi * std::pow(18.0 / 4.0, 3), 0.35 * 382);
  EXPECT_GE(second, 4.0 / 3.0 * pi * 8);
}

TEST(SpacedInteriorPoints, LieOnNoPlaneTogether) {
  const Points points = spaced_interior_points(box({0.04, 0.04, 0.04}, 4e-3).mesh, 4e-3, 2e-3);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd along = points.row(axis);
    EXPECT_GT(along.cwiseAbs().minCoeff(), 0.0);
    // Were they on planes a spacing apart, 1/10 of the range would hold no point in between.
    std::sort(along.begin(), along.end());
    const double largest_step = (along.tail(along.size() - 1) - along.head(along.size() - 1)).maxCoeff();
    EXPECT_LT(largest_step, 0.1 * 4e-3 * 4);
  }
}

TEST(SpacedInteriorPoints, AreTheSameEveryTime) {
  const TriangleMesh& mesh = pointing_hand().mesh;
  EXPECT_EQ(spaced_interior_points(mesh, 6e-3, 3e-3), spaced_interior_points(mesh, 6e-3, 3e-3));
}

TEST(SpacedInteriorPoints, AreAsManyAfterAMove) {
  const TriangleMesh& mesh = pointing_hand().mesh;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.8, Vector3(1, 2, -1).normalized()).toRotationMatrix();
  const auto before = static_cast<double>(spaced_interior_points(mesh, 5e-3, 3e-3).cols());
  const auto after =
      static_cast<double>(spaced_interior_points(transformed(mesh, turn, {0.3, -0.1, 0.2}), 5e-3, 3e-3).cols());
  EXPECT_NEAR(after / before, 1.0, 0.04);
}

TEST(SpacedInteriorPoints, NoneWhereTheBodyIsThin) {
  const TriangleMesh plate = box({0.05, 0.05, 4e-3}, 2e-3).mesh;
  EXPECT_EQ(spaced_interior_points(plate, 3e-3, 2.1e-3).cols(), 0);
  EXPECT_EQ(spaced_interior_points(plate, 3e-3, 1.0).cols(), 0);
  EXPECT_GT(spaced_interior_points(plate, 3e-3, 1e-3).cols(), 0);
}

TEST(SpacedInteriorPoints, RefuseWhatIsNoSpacing) {
  const TriangleMesh mesh = icosphere(0.02, 3);
  EXPECT_THAT([&] { spaced_interior_points(mesh, 0, 1e-3); }, ThrowsMessage<InputError>(HasSubstr("spacing = 0")));
  EXPECT_THROW(spaced_interior_points(mesh, kNan, 1e-3), InputError);
  EXPECT_THAT([&] { spaced_interior_points(mesh, 1e-3, -1); }, ThrowsMessage<InputError>(HasSubstr("clearance = -1")));
  EXPECT_THAT([&] { spaced_interior_points(mesh, 1e-6, 1e-3); }, ThrowsMessage<InputError>(HasSubstr("candidates")));
}

class InteriorSourcesTest : public ::testing::TestWithParam<int> {};

TEST_P(InteriorSourcesTest, LieDeepEnoughHalfOfThemNearTheTarget) {
  const Body& body = pointing_hand();
  const TriangleMesh& mesh = body.mesh;
  const Vector3 target = position(mesh, find_landmark(body, "palm_centre"));
  const double reach = 0.03;
  const int count = GetParam();
  const Points sources = interior_sources(mesh, target, reach, count, 1);
  ASSERT_EQ(sources.cols(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Vector3 x = sources.col(i);
    const Landmark skin = nearest_landmark(mesh, "skin", x);
    const Vector3 outwards = position(mesh, skin) - x;
    EXPECT_GE(outwards.norm(), 1.5 * mesh.local_edge(skin.face) * (1 - 1e-6)) << i;
    EXPECT_GT(outwards.dot(mesh.normals().col(skin.face)), 0) << i;
  }
  const Eigen::Index half = (count + 1) / 2;
  EXPECT_LE((sources.leftCols(half).colwise() - target).colwise().norm().maxCoeff(), reach);
  EXPECT_GT(least_distance(sources), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Counts, InteriorSourcesTest, ::testing::Values(1, 2, 9, 16, 60));

TEST(InteriorSources, SpreadOverTheWholeBody) {
  const double length = 0.2;
  const TriangleMesh mesh = capsule(0.02, length, 4e-3).mesh;
  const double reach = 0.03;
  const Points sources = interior_sources(mesh, {0, -length / 2, -0.02}, reach, 16, 1);
  const Points near = sources.leftCols(8);
  const Points spread = sources.rightCols(8);
  EXPECT_GT(spread.row(1).maxCoeff(), 0.25 * length);
  // Eight points in a finger of ten radii: a radius apart; eight within 30 mm: a quarter of a radius.
  EXPECT_GT(least_distance(spread), 0.02);
  EXPECT_GT(least_distance(near), 0.005);
  EXPECT_GT(depths(mesh, near).mean(), depths(mesh, spread).mean());
  // Off the axis, by the share of the depth that is left above them.
  for (const Vector3 x : sources.colwise()) {
    EXPECT_GT(from_axis(x, length), 1e-4);
  }
}

TEST(InteriorSources, FollowTheSeed) {
  const TriangleMesh mesh = icosphere(0.03, 10);
  const Vector3 target(0, 0, -0.03);
  EXPECT_EQ(interior_sources(mesh, target, 0.02, 12, 5), interior_sources(mesh, target, 0.02, 12, 5));
  EXPECT_NE(interior_sources(mesh, target, 0.02, 12, 5), interior_sources(mesh, target, 0.02, 12, 6));
}

// The bar beside the target is too thin for a source: all lie in the ball.
TEST(InteriorSources, ComeFromTheWholeBodyWhereThePartIsThin) {
  const TriangleMesh mesh = together(icosphere(0.03, 10), shifted(box({0.01, 4e-3, 4e-3}, 2e-3).mesh, {0.05, 0, 0}));
  const Points sources = interior_sources(mesh, {0.055, 0, 0}, 0.01, 10, 1);
  ASSERT_EQ(sources.cols(), 10);
  EXPECT_LT(sources.colwise().norm().maxCoeff(), 0.03);
}

// Of the sheet that is deep enough, 0.95 of 3.5 mm against 1.5 edges of 2 mm, a third of a millimetre is left.
TEST(InteriorSources, FindTheMiddleOfAPlate) {
  const TriangleMesh plate = box({0.05, 0.05, 7e-3}, 2e-3).mesh;
  const Points sources = interior_sources(plate, {0, 0, 3.5e-3}, 0.02, 30, 1);
  ASSERT_EQ(sources.cols(), 30);
  EXPECT_LT(sources.row(2).cwiseAbs().maxCoeff(), 0.6e-3);
  EXPECT_GT(sources.row(2).cwiseAbs().minCoeff(), 0.05 * 3.5e-3 * 0.999);
}

// One face in forty has a deep place under it.
TEST(InteriorSources, FindTheOnePartThatIsThick) {
  const TriangleMesh plate = box({0.05, 0.05, 2e-3}, 1e-3).mesh;
  const TriangleMesh ball = icosphere(0.01, 4);
  ASSERT_GT(plate.face_count(), 35 * ball.face_count());
  const Points sources = interior_sources(together(plate, shifted(ball, {0.05, 0, 0})), {0, 0, 1e-3}, 0.02, 12, 1);
  ASSERT_EQ(sources.cols(), 12);
  EXPECT_LT((sources.colwise() - Vector3(0.05, 0, 0)).colwise().norm().maxCoeff(), 0.01);
}

TEST(InteriorSources, RefuseAThinBody) {
  // Half of 4 mm is less than 1.5 edges of 2 mm; places are sought at up to 0.95 of the half.
  const TriangleMesh plate = box({0.05, 0.05, 4e-3}, 2e-3).mesh;
  EXPECT_THAT(
      [&] {
        interior_sources(plate, {0, 0, 2e-3}, 0.02, 8, 1);
      },
      ThrowsMessage<InputError>(AllOf(HasSubstr("deeper than 1.5 edges"), HasSubstr("with 1.900 mm"))));
  const TriangleMesh mesh = icosphere(0.03, 10);
  EXPECT_THAT(
      [&] {
        interior_sources(mesh, {0, 0, 0.03}, 0, 8, 1);
      },
      ThrowsMessage<InputError>(HasSubstr("reach = 0")));
  EXPECT_THAT(
      [&] {
        interior_sources(mesh, {0, 0, 0.03}, 0.02, 0, 1);
      },
      ThrowsMessage<InputError>(HasSubstr("count = 0")));
  EXPECT_THROW(interior_sources(mesh, {0, kNan, 0.03}, 0.02, 8, 1), InputError);
}

}  // namespace touchfield::interior_points_test
