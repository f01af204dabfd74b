#include "sim/hand/shapes.h"

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sim/hand/body.h"
#include "sim/mesh/query/inspect.h"
#include "tests/support/testing.h"

namespace touchfield::shapes_test {

using std::numbers::pi;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegree = pi / 180.0;

TEST(Icosphere, HasTheFacesAndTheVolumeOfItsName) {
  for (const int f : {1, 2, 3, 16}) {
    const MeshReport report = inspect(icosphere(0.008, f));
    EXPECT_THAT(report.faults, IsEmpty());
    EXPECT_EQ(report.faces, 20 * f * f);
    EXPECT_EQ(report.vertices, 10 * f * f + 2);  // Euler: V = F / 2 + 2
    EXPECT_EQ(report.unused_vertices, 0);
    EXPECT_EQ(report.components, 1);
    EXPECT_NEAR(report.volume / (4.0 / 3.0 * pi * std::pow(0.008, 3)), 1.0, 1e-13);
    EXPECT_GT(report.smallest_angle, 50.0 * kDegree);  // 53.9 as f grows: the corners of the icosahedron have 5 faces
  }
  const Eigen::VectorXd radii = icosphere(0.1, 16).vertices().colwise().norm();
  EXPECT_NEAR(radii.minCoeff(), radii.maxCoeff(), 1e-15);
}

/// A landmark of each name lies at the body's end along its axis.
void expect_landmarks(const Body& body, const Vector3& half, double tolerance) {
  const std::array<const char*, 6> names = {"x_plus", "y_plus", "top", "x_minus", "y_minus", "bottom"};
  for (int i = 0; i < 6; ++i) {
    const Landmark& landmark = find_landmark(body, names[static_cast<std::size_t>(i)]);
    const Vector3 expected = (i < 3 ? half(i % 3) : -half(i % 3)) * Vector3::Unit(i % 3);
    EXPECT_LT((position(body.mesh, landmark) - expected).norm(), tolerance) << landmark.name;
  }
}

TEST(SphereShape, TakesTheFrequencyNearestToTheEdge) {
  for (const double edge : {0.7e-3, 1.43e-3}) {
    const double reached = sphere(0.02, edge).mesh.mean_edge();
    const int f =
        static_cast<int>(std::lround(std::sqrt(static_cast<double>(sphere(0.02, edge).mesh.face_count()) / 20)));
    EXPECT_LE(std::abs(reached - edge), std::abs(icosphere(0.02, f + 1).mean_edge() - edge));
    EXPECT_LE(std::abs(reached - edge), std::abs(icosphere(0.02, f - 1).mean_edge() - edge));
  }
  EXPECT_EQ(sphere(0.02, 1.0).mesh.face_count(), 20);
  // The sagitta of an edge is (2 mm)^2 / (8 * 20 mm) = 0.025 mm.
  expect_landmarks(sphere(0.02, 2e-3), Vector3::Constant(0.02), 1e-4);
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
  expect_landmarks(body, {radius, 0.5 * length + radius, radius}, tolerance);
}

INSTANTIATE_TEST_SUITE_P(Sizes, CapsuleTest,
                         ::testing::Values(std::array{8e-3, 50e-3, 1.4e-3}, std::array{8e-3, 50e-3, 4e-3},
                                           std::array{10e-3, 0.0, 1e-3}, std::array{1e-3, 0.2, 0.5e-3},
                                           std::array{30e-3, 1e-3, 3e-3}));

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
  expect_landmarks(body, 0.5 * size, 1e-12);
}

TEST(Shapes, RefuseWhatIsNoShape) {
  const std::vector<std::pair<std::function<void()>, std::string>> cases = {
      {[] { sphere(0, 1e-3); }, "sphere.radius = 0"},
      {[] { sphere(kNan, 1e-3); }, "sphere.radius"},
      {[] { sphere(0.01, -1e-3); }, "sphere.edge = -0.001"},
      {[] { sphere(0.01, 1e-7); }, "faces; at most"},
      {[] { icosphere(0.01, 100000); }, "must be 1 to 500"},
      {[] { capsule(0.01, -0.01, 1e-3); }, "capsule.length = -0.01"},
      {[] { capsule(0.01, 1e9, 1e-3); }, "faces; at most"},
      {[] { capsule(1e-7, 0.1, 2.6e-3); }, "edges of 1e-07 m would take"},  // faces are as small as the radius
      {[] { box(Vector3(0.01, kNan, 0.01), 1e-3); }, "box.size[1]"},
      {[] { box(Vector3(0.01, 0.01, 0.01), 0); }, "box.edge"},
      {[] { box(Vector3(1e6, 1e-7, 1e-7), 1e-3); }, "faces; at most"}};
  for (const auto& [shape, phrase] : cases) {
    EXPECT_THAT(message_of<InputError>(shape), HasSubstr(phrase));
  }
}

constexpr double kRounding = 1e-15;  // [m] of bodies below a metre

TEST(FindLandmark, ListsTheNamesThereAre) {
  const Body body = sphere(0.01, 0.005);
  EXPECT_EQ(find_landmark(body, "top").name, "top");
  EXPECT_THAT([&] { find_landmark(body, "index_pad"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("'index_pad'"), HasSubstr("top, bottom, x_plus"))));
  EXPECT_THAT([&] { find_landmark(Body{body.mesh, {}}, "top"); }, ThrowsMessage<InputError>(HasSubstr("it has none")));
}

// On a box the nearest point is known: the point clamped to the box.
TEST(NearestLandmark, IsTheNearestPointOfTheSurface) {
  const Vector3 half(0.01, 0.02, 0.03);
  const TriangleMesh mesh = box(2.0 * half, 0.004).mesh;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.06, 0.06);
  for (int i = 0; i < 50; ++i) {
    const Vector3 outside(uniform(random), uniform(random), uniform(random));
    if ((outside.cwiseAbs() - half).maxCoeff() <= 0) {
      continue;
    }
    const Landmark landmark = nearest_landmark(mesh, "p", outside);
    const Vector3 expected = outside.cwiseMax(-half).cwiseMin(half);
    EXPECT_LT((position(mesh, landmark) - expected).norm(), 1e-12) << outside.transpose();
    EXPECT_NEAR(landmark.barycentric.sum(), 1.0, 1e-12);
    EXPECT_GE(landmark.barycentric.minCoeff(), 0.0);
  }
  const Vector3 nowhere(0, kNan, 0);
  EXPECT_THROW(nearest_landmark(mesh, "p", nowhere), InputError);
}

// First about the fixed x: y goes to z; then about the fixed z: z stays. (Intrinsic turns would take y to x's place.)
TEST(Placed, TurnsAboutFixedAxesInOrderAboutTheAnchor) {
  const Body body = box({0.02, 0.04, 0.06}, 0.02);
  const Vector3 anchor = position(body.mesh, find_landmark(body, "y_plus"));  // (0, 20 mm, 0)
  const Vector3 at(0.1, -0.2, 0.3);
  const Body moved = placed(body, anchor, at, {std::numbers::pi / 2, 0, std::numbers::pi / 2});
  EXPECT_LT((position(moved.mesh, find_landmark(moved, "y_plus")) - at).norm(), kRounding);
  const Vector3 centre_at = moved.mesh.vertices().rowwise().mean();
  // From the anchor the centre lies 20 mm along -y: about x by 90 degrees it lies along -z, about z it stays there.
  EXPECT_LT((centre_at - at - Vector3(0, 0, -0.02)).norm(), kRounding);
}

}  // namespace touchfield::shapes_test
