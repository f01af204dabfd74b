#include "sim/hand/shapes.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>

#include "sim/mesh/query/inspect.h"
#include "tests/support/testing.h"

namespace touchfield::shapes_test {

using std::numbers::pi;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = pi / 180.0;

Vector3 landmark(const Body& body, const std::string& name) { return position(body.mesh, find_landmark(body, name)); }

TEST(Icosphere, HasTheFacesAndTheVolumeOfItsName) {
  for (const int f : {1, 2, 3, 7, 16}) {
    const MeshReport report = inspect(icosphere(0.008, f));
    EXPECT_THAT(report.faults, IsEmpty());
    EXPECT_EQ(report.faces, 20 * f * f);
    EXPECT_EQ(report.vertices, 10 * f * f + 2);  // Euler: V = F / 2 + 2
    EXPECT_EQ(report.unused_vertices, 0);
    EXPECT_EQ(report.components, 1);
    EXPECT_NEAR(report.volume / (4.0 / 3.0 * pi * std::pow(0.008, 3)), 1.0, 1e-13);
    EXPECT_GT(report.smallest_angle, 50.0 * kDegree);  // 53.9 as f grows: the corners of the icosahedron have 5 faces
  }
}

TEST(Icosphere, VerticesLieOnOneSphereJustOutside) {
  const Eigen::VectorXd radii = icosphere(0.1, 16).vertices().colwise().norm();
  EXPECT_NEAR(radii.minCoeff(), radii.maxCoeff(), 1e-15);
  EXPECT_GT(radii(0), 0.1);
  EXPECT_LT(radii(0), 0.1 * 1.002);  // 1/4 (edge / radius)^2 / 3 = 0.0005 at f = 16
}

// Equal arcs along the edges: splitting in two and again in two is splitting in four there.
TEST(Icosphere, FrequenciesNest) {
  const TriangleMesh coarse = icosphere(1.0, 2);
  const TriangleMesh fine = icosphere(1.0, 4);
  const Points unit = fine.vertices().colwise().normalized();
  for (Eigen::Index v = 0; v < coarse.vertex_count(); ++v) {
    const Vector3 direction = coarse.vertices().col(v).normalized();
    EXPECT_LT((unit.colwise() - direction).colwise().norm().minCoeff(), 1e-14);
  }
}

TEST(SphereShape, TakesTheFrequencyNearestToTheEdge) {
  for (const double edge : {0.7e-3, 1e-3, 1.43e-3, 3e-3}) {
    const double reached = sphere(0.02, edge).mesh.mean_edge();
    const int f =
        static_cast<int>(std::lround(std::sqrt(static_cast<double>(sphere(0.02, edge).mesh.face_count()) / 20)));
    EXPECT_LE(std::abs(reached - edge), std::abs(icosphere(0.02, f + 1).mean_edge() - edge));
    EXPECT_LE(std::abs(reached - edge), std::abs(icosphere(0.02, f - 1).mean_edge() - edge));
  }
  EXPECT_EQ(sphere(0.02, 1.0).mesh.face_count(), 20);
}

TEST(SphereShape, LandmarksLieOnTheAxes) {
  const Body body = sphere(0.02, 2e-3);
  const double tolerance = 1e-4;  // sagitta of an edge: (2 mm)^2 / (8 * 20 mm) = 0.025 mm
  EXPECT_LT((landmark(body, "top") - Vector3(0, 0, 0.02)).norm(), tolerance);
  EXPECT_LT((landmark(body, "bottom") - Vector3(0, 0, -0.02)).norm(), tolerance);
  EXPECT_LT((landmark(body, "x_plus") - Vector3(0.02, 0, 0)).norm(), tolerance);
  EXPECT_LT((landmark(body, "x_minus") - Vector3(-0.02, 0, 0)).norm(), tolerance);
  EXPECT_LT((landmark(body, "y_plus") - Vector3(0, 0.02, 0)).norm(), tolerance);
  EXPECT_LT((landmark(body, "y_minus") - Vector3(0, -0.02, 0)).norm(), tolerance);
}

TEST(SphereShape, RefusesWhatIsNoSphere) {
  EXPECT_THAT([] { sphere(0, 1e-3); }, ThrowsMessage<InputError>(HasSubstr("sphere.radius = 0")));
  EXPECT_THAT([] { sphere(0.01, -1e-3); }, ThrowsMessage<InputError>(HasSubstr("sphere.edge = -0.001")));
  EXPECT_THROW(sphere(kNan, 1e-3), InputError);
  EXPECT_THROW(sphere(0.01, kNan), InputError);
  EXPECT_THROW(sphere(std::numeric_limits<double>::infinity(), 1e-3), InputError);
  EXPECT_THAT([] { sphere(0.01, 1e-7); }, ThrowsMessage<InputError>(HasSubstr("faces; at most")));
  EXPECT_THROW(icosphere(0.01, 0), InputError);
  EXPECT_THROW(icosphere(0.01, 100000), InputError);
}

class CapsuleTest : public ::testing::TestWithParam<std::array<double, 3>> {};

TEST_P(CapsuleTest, IsUniformAndHasTheCapsulesVolume) {
  const auto [radius, length, edge] = GetParam();
  const Body body = capsule(radius, length, edge);
  const MeshReport report = inspect(body.mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.vertices, report.faces / 2 + 2);  // no handle
  EXPECT_NEAR(report.volume / (pi * radius * radius * (length + 4.0 / 3.0 * radius)), 1.0, 1e-9);
  EXPECT_NEAR(body.mesh.mean_edge() / edge, 1.0, 0.03);
  EXPECT_GT(report.smallest_angle, 25.0 * kDegree);  // seen: 36 to 51
  EXPECT_GT(report.shortest_edge, 0.5 * edge);
  EXPECT_LT(report.longest_edge, 1.7 * edge);

  // All vertices at one distance from the axis.
  Eigen::VectorXd distance(body.mesh.vertex_count());
  for (Eigen::Index v = 0; v < distance.size(); ++v) {
    Vector3 x = body.mesh.vertices().col(v);
    x.y() -= std::min(std::max(x.y(), -0.5 * length), 0.5 * length);
    distance(v) = x.norm();
  }
  EXPECT_NEAR(distance.minCoeff(), distance.maxCoeff(), 1e-12);
  EXPECT_GT(distance(0), radius);

  const double tolerance =
      0.05 * edge + 0.3 * edge * edge / radius;  // sagitta, and the vertices' height above the radius
  EXPECT_LT((landmark(body, "y_plus") - Vector3(0, 0.5 * length + radius, 0)).norm(), tolerance);
  EXPECT_LT((landmark(body, "y_minus") - Vector3(0, -0.5 * length - radius, 0)).norm(), tolerance);
  EXPECT_LT((landmark(body, "top") - Vector3(0, 0, radius)).norm(), tolerance);
  EXPECT_LT((landmark(body, "x_minus") - Vector3(-radius, 0, 0)).norm(), tolerance);
}

INSTANTIATE_TEST_SUITE_P(Sizes, CapsuleTest,
                         ::testing::Values(std::array{8e-3, 50e-3, 1.4e-3}, std::array{8e-3, 50e-3, 4e-3},
                                           std::array{10e-3, 0.0, 1e-3}, std::array{1e-3, 0.2, 0.5e-3},
                                           std::array{30e-3, 1e-3, 3e-3}));

TEST(Capsule, AnEdgeAboveTheRadiusIsTakenAsTheRadius) {
  EXPECT_EQ(capsule(0.01, 0.05, 0.03).mesh.face_count(), capsule(0.01, 0.05, 0.01).mesh.face_count());
}

TEST(Capsule, RefusesWhatIsNoCapsule) {
  EXPECT_THAT([] { capsule(0.01, -0.01, 1e-3); }, ThrowsMessage<InputError>(HasSubstr("capsule.length = -0.01")));
  EXPECT_THROW(capsule(0, 0.01, 1e-3), InputError);
  EXPECT_THROW(capsule(0.01, kNan, 1e-3), InputError);
  EXPECT_THROW(capsule(0.01, 0.05, 0), InputError);
  EXPECT_THROW(capsule(0.01, 1e9, 1e-3), InputError);
  // Faces are as small as the radius, whatever the edge.
  EXPECT_THAT([] { capsule(1e-7, 0.1, 2.6e-3); }, ThrowsMessage<InputError>(HasSubstr("edges of 1e-07 m would take")));
}

TEST(Box, CountsTheSquaresOfAThinSide) {
  EXPECT_THAT([] { box({1e6, 1e-7, 1e-7}, 1e-3); }, ThrowsMessage<InputError>(HasSubstr("faces; at most")));
}

TEST(Box, IsExactWithSharpEdges) {
  const Vector3 size(0.01, 0.023, 0.037);
  const Body body = box(size, 1.5e-3);
  const MeshReport report = inspect(body.mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_NEAR(report.volume / size.prod(), 1.0, 1e-13);
  EXPECT_NEAR(report.area / (2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x())), 1.0, 1e-13);
  EXPECT_NEAR(body.mesh.mean_edge() / 1.5e-3, 1.0, 0.05);  // whole numbers of squares: half a one in 7, twice
  EXPECT_GT(report.smallest_angle, 40.0 * kDegree);        // 45 for squares
  // Every face lies in a side: its normal is an axis. Six sides in all.
  std::set<int> sides;
  for (const auto& normal : body.mesh.normals().colwise()) {
    Eigen::Index axis = 0;
    ASSERT_NEAR(normal.cwiseAbs().maxCoeff(&axis), 1.0, 1e-12);
    sides.insert(static_cast<int>(normal(axis) > 0 ? axis : axis + 3));
  }
  EXPECT_EQ(sides.size(), 6u);
  EXPECT_LT((landmark(body, "top") - Vector3(0, 0, 0.5 * size.z())).norm(), 1e-12);
  EXPECT_LT((landmark(body, "y_minus") - Vector3(0, -0.5 * size.y(), 0)).norm(), 1e-12);
}

TEST(Box, HasTwelveFacesAtLeast) { EXPECT_EQ(box({0.01, 0.02, 0.03}, 1.0).mesh.face_count(), 12); }

TEST(Box, RefusesWhatIsNoBox) {
  EXPECT_THAT([] { box({0.01, 0, 0.01}, 1e-3); }, ThrowsMessage<InputError>(HasSubstr("box.size[1] = 0")));
  EXPECT_THROW(box({0.01, kNan, 0.01}, 1e-3), InputError);
  EXPECT_THROW(box({0.01, 0.01, 0.01}, 0), InputError);
  EXPECT_THROW(box({1, 1, 1}, 1e-5), InputError);
}

}  // namespace touchfield::shapes_test
