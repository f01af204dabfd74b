#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "sim/hand/implicit_surface.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "tests/support/testing.h"
#include "tests/support/threads_support.h"

namespace touchfield::skin_mesh_test {

using std::numbers::pi;

SoftBody cone_body(const Vector3& a, const Vector3& b, double radius_a, double radius_b) {
  SoftPart part;
  part.cones.push_back({a, b, radius_a, radius_b});
  return SoftBody({part});
}

Vector3 random_point(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return {uniform(random), uniform(random), uniform(random)};
}

// The body is the union of the balls along the segment, so outside the distance is the least over them.
TEST(SoftBody, DistanceToAConeIsThatToItsBalls) {
  std::mt19937 random(3);
  for (const double radius_b : {0.3, 0.1, 0.29, 0.9}) {
    const Vector3 a(0.1, -0.2, 0.0);
    const Vector3 b(0.5, 0.3, 0.1);
    const SoftBody body = cone_body(a, b, 0.3, radius_b);
    for (int i = 0; i < 200; ++i) {
      const Vector3 x = random_point(random);
      double least = std::numeric_limits<double>::infinity();
      constexpr int kSteps = 2000;
      for (int s = 0; s <= kSteps; ++s) {
        const double t = static_cast<double>(s) / kSteps;
        least = std::min(least, (x - a - t * (b - a)).norm() - 0.3 - t * (radius_b - 0.3));
      }
      EXPECT_NEAR(body.distance(x), least, 1e-5) << radius_b;  // half a step is 1.6e-4, of a flat minimum
    }
  }
}

TEST(SkinMesh, RefusesABodyInTwoPieces) {
  SoftPart part;
  part.cones = {{{0, 0, 0}, {0.01, 0, 0}, 0.005, 0.005}, {{0, 0.05, 0}, {0.01, 0.05, 0}, 0.005, 0.005}};
  EXPECT_THROW(skin_mesh(SoftBody({part}), 2e-3, 1e-3), NumericalError);
}

SoftBody ball_of(double radius) { return cone_body(Vector3::Zero(), {1e-9, 0, 0}, radius, radius); }

TEST(SkinMesh, FollowsTheSizesAskedFor) {
  const double radius = 0.01;
  for (const double growth : {0.1, 0.3}) {
    const EdgeSizing sizing(3e-3, {{Vector3(0, 0, radius), 0.6e-3, 4e-3}}, growth);
    const TriangleMesh mesh = skin_mesh(ball_of(radius), sizing, 1e-3);
    EXPECT_THAT(inspect(mesh).faults, IsEmpty());
    EXPECT_NEAR(static_cast<double>(mesh.face_count()) / wanted_faces(icosphere(radius, 30), sizing, 1e6), 1.0, 0.06);
    EXPECT_GT(edge_fit(mesh, sizing).share, 0.99);
    EXPECT_NEAR(edge_fit(mesh, sizing).mean_log, 0.0, 0.04);
    EXPECT_GT(inspect(mesh).smallest_angle, 25 * pi / 180);
    EXPECT_NEAR(mesh.signed_volume() / (4.0 / 3.0 * pi * std::pow(radius, 3)), 1.0, 2e-3);
  }
}

// The faces' corners are on the sphere but for the lift, so area and volume are off by a share of (edge / radius)^2.
TEST(SkinMesh, AreaAndVolumeConvergeWithTheEdge) {
  const double radius = 0.01;
  std::array<double, 2> area_error{};
  for (std::size_t i = 0; i < 2; ++i) {
    const TriangleMesh mesh = skin_mesh(ball_of(radius), i == 0 ? 3e-3 : 1e-3, 1e-3);
    area_error[i] = std::abs(mesh.total_area() / (4.0 * pi * radius * radius) - 1.0);
    EXPECT_NEAR(mesh.signed_volume() / (4.0 / 3.0 * pi * std::pow(radius, 3)), 1.0, i == 0 ? 2e-3 : 2e-4);
  }
  EXPECT_GT(area_error[0] / area_error[1], 5.0);  // of 9
  EXPECT_LT(area_error[0] / area_error[1], 16.0);
}

TEST(SkinMesh, DoesNotDependOnTheNumberOfThreads) {
  const SoftBody body = cone_body(Vector3::Zero(), {0.02, 0, 0}, 0.006, 0.004);
  const EdgeSizing sizing(2e-3, {{Vector3(0.02, 0, 0), 0.7e-3, 4e-3}});
  const TriangleMesh one = with_threads(1, [&] { return skin_mesh(body, sizing, 1e-3); });
  const TriangleMesh other = with_threads(5, [&] { return skin_mesh(body, sizing, 1e-3); });
  ASSERT_EQ(one.vertex_count(), other.vertex_count());
  EXPECT_TRUE(one.vertices() == other.vertices());
  EXPECT_TRUE(one.triangles() == other.triangles());
}

// Two fingers side by side on a base, 1.5 mm apart, meshed with edges twice as long as the gap is wide.
TEST(SkinMesh, KeepsAGapOpenThatIsNarrowerThanItsEdges) {
  SoftPart part;
  const double radius = 7e-3;
  const double apart = 2 * radius + 1.5e-3;
  part.cones = {{{0, 0, 0}, {0, 0.05, 0}, radius, radius},
                {{apart, 0, 0}, {apart, 0.05, 0}, radius, radius},
                {{0, 0, 0}, {apart, 0, 0}, radius, radius}};
  const SoftBody body({part});
  const EdgeSizing sizing(3e-3, {{Vector3(0, 0.05, 0), 1.2e-3, 10e-3}});
  const TriangleMesh mesh = skin_mesh(body, sizing, 1.2e-3);
  const MeshReport report = inspect(mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.vertices - report.faces / 2, 2);
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
  const FaceTree tree(mesh);
  // Edges of 3 mm cannot follow the bottom of the slit, at 7 mm.
  for (double y = 0.0105; y < 0.05; y += 0.5e-3) {
    EXPECT_LT(tree.winding_number({0.5 * apart, y, 0}), 0.5) << y;
    EXPECT_GT(tree.winding_number({0.5 * apart - 1.5e-3, y, 0}), 0.5) << y;
  }
}

}  // namespace touchfield::skin_mesh_test
