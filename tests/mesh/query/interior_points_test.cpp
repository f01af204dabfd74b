#include "sim/mesh/query/interior_points.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "tests/support/testing.h"

namespace touchfield::interior_points_test {

using std::numbers::pi;

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

TEST(SpacedInteriorPoints, AreTheSameEveryTime) {
  const TriangleMesh& mesh = pointing_hand().mesh;
  EXPECT_EQ(spaced_interior_points(mesh, 6e-3, 3e-3), spaced_interior_points(mesh, 6e-3, 3e-3));
}

TEST(SpacedInteriorPoints, NoneWhereTheBodyIsThin) {
  const TriangleMesh plate = box({0.05, 0.05, 4e-3}, 2e-3).mesh;
  EXPECT_EQ(spaced_interior_points(plate, 3e-3, 2.1e-3).cols(), 0);
  EXPECT_EQ(spaced_interior_points(plate, 3e-3, 1.0).cols(), 0);
  EXPECT_GT(spaced_interior_points(plate, 3e-3, 1e-3).cols(), 0);
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

INSTANTIATE_TEST_SUITE_P(Counts, InteriorSourcesTest, ::testing::Values(1, 9, 60));

TEST(InteriorSources, RefuseAThinBody) {
  // Half of 4 mm is less than 1.5 edges of 2 mm; places are sought at up to 0.95 of the half.
  const TriangleMesh plate = box({0.05, 0.05, 4e-3}, 2e-3).mesh;
  EXPECT_THAT(message_of<InputError>([&] { interior_sources(plate, Vector3(0, 0, 2e-3), 0.02, 8, 1); }),
              AllOf(HasSubstr("deeper than 1.5 edges"), HasSubstr("with 1.900 mm")));
}

}  // namespace touchfield::interior_points_test
