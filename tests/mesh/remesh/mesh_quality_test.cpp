#include "sim/mesh/remesh/mesh_quality.h"

#include <cmath>
#include <numbers>

#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"

namespace touchfield::mesh_quality_test {

using std::numbers::pi;

constexpr double kDegree = pi / 180.0;

/// Rows of equilateral triangles of one side in the plane z = 0, sheared into a parallelogram: 2 n^2 faces.
TriangleMesh lattice(double side, int n) {
  Points points(3, (n + 1) * (n + 1));
  Triangles triangles(3, 2 * n * n);
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      points.col(j * (n + 1) + i) << side * (i + 0.5 * j), side * std::sqrt(0.75) * j, 0;
    }
  }
  Eigen::Index count = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int v = j * (n + 1) + i;
      triangles.col(count++) << v, v + 1, v + n + 1;
      triangles.col(count++) << v + 1, v + n + 2, v + n + 1;
    }
  }
  return {points, triangles};
}

TriangleMesh right_triangle(double a, double b) {
  Points points(3, 3);
  points << 0, a, 0, 0, 0, b, 0, 0, 0;
  return {points, Triangles(Eigen::Vector3i(0, 1, 2))};
}

TEST(MeshQuality, OfEquilateralTrianglesIsAsByDefinition) {
  const double side = 2e-3;
  const double wavelength = 8.6e-3;
  const MeshQuality quality = mesh_quality(lattice(side, 10), wavelength, EdgeSizing(side));
  EXPECT_NEAR(quality.smallest_angle, 60 * kDegree, 1e-12);
  EXPECT_NEAR(quality.smallest_angle_1, 60 * kDegree, 1e-12);
  EXPECT_EQ(quality.resolution.faces, 200);
  EXPECT_NEAR(quality.resolution.mean, wavelength / side, 1e-12);
  EXPECT_NEAR(quality.resolution.least, wavelength / side, 1e-12);
  ASSERT_TRUE(quality.edges);
  EXPECT_EQ(quality.edges->share, 1.0);
  EXPECT_NEAR(quality.edges->mean_log, 0, 1e-12);
  EXPECT_NEAR(quality.edges->rms_log, 0, 1e-12);
  EXPECT_FALSE(mesh_quality(lattice(side, 10), wavelength).edges);
}

TEST(MeshQuality, AnglesOfARightTriangle) {
  const Eigen::VectorXd angles = smallest_angles(right_triangle(4.0, 3.0));
  ASSERT_EQ(angles.size(), 1);
  EXPECT_NEAR(angles(0), std::atan2(3.0, 4.0), 1e-15);
  // 1e-7 of a radian: where an arc cosine would have lost half its digits.
  EXPECT_NEAR(smallest_angles(right_triangle(1.0, 1e-7))(0) / 1e-7, 1.0, 1e-9);
}

// One bad face among 200: 0.5 %, so the percentile does not see it; among 50 it does.
TEST(MeshQuality, PercentileLeavesOutOnePercentOfTheFaces) {
  for (const auto& [n, seen] : {std::pair{10, false}, {5, true}}) {
    const TriangleMesh mesh = together(shifted(lattice(1.0, n), Vector3(5, 5, 0)), right_triangle(1.0, 0.1));
    const MeshQuality quality = mesh_quality(mesh, 1.0);
    EXPECT_NEAR(quality.smallest_angle, std::atan2(0.1, 1.0), 1e-12);
    EXPECT_NEAR(quality.smallest_angle_1, seen ? quality.smallest_angle : 60 * kDegree, 1e-9) << n;
  }
}

// All edges have one length, so every ratio is length / asked; each edge counts once.
TEST(EdgeFit, CountsWhatIsWithinTheLimits) {
  const TriangleMesh mesh = lattice(1e-3, 6);
  for (const auto& [asked, within] :
       {std::pair{1e-3 / 0.59, 0.0}, {1e-3 / 0.61, 1.0}, {1e-3 / 1.59, 1.0}, {1e-3 / 1.61, 0.0}}) {
    const EdgeFit fit = edge_fit(mesh, EdgeSizing(asked));
    EXPECT_EQ(fit.share, within) << asked;
    EXPECT_NEAR(fit.mean_log, std::log(1e-3 / asked), 1e-12);
    EXPECT_NEAR(fit.rms_log, std::abs(std::log(1e-3 / asked)), 1e-12);
    EXPECT_NEAR(fit.shortest, 1e-3 / asked, 1e-12);
    EXPECT_NEAR(fit.longest, 1e-3 / asked, 1e-12);
  }
  // A triangle with sides 3, 4, 5 asked for 4: of ratios 3/4, 1 and 5/4, all within; asked for 8: 3/8 and 1/2 are not.
  const TriangleMesh triangle = right_triangle(4e-3, 3e-3);
  const EdgeFit fit = edge_fit(triangle, EdgeSizing(8e-3));
  EXPECT_NEAR(fit.share, 1.0 / 3.0, 1e-15);
  EXPECT_NEAR(fit.mean_log, std::log(3.0 * 4.0 * 5.0 / 512.0) / 3.0, 1e-12);
  EXPECT_NEAR(fit.shortest, 3.0 / 8.0, 1e-12);
  EXPECT_NEAR(fit.longest, 5.0 / 8.0, 1e-12);
  EXPECT_NEAR(edge_fit(triangle, EdgeSizing(4e-3)).share, 1.0, 1e-15);
}

TEST(Resolution, IsThatOfTheFacesWithinAZone) {
  const TriangleMesh mesh = together(lattice(1e-3, 10), shifted(lattice(2e-3, 10), Vector3(0.1, 0, 0)));
  const double wavelength = 8.6e-3;
  const Resolution all = mesh_quality(mesh, wavelength).resolution;
  EXPECT_EQ(all.faces, 400);
  EXPECT_NEAR(all.mean, wavelength / std::sqrt(0.5 * (1e-6 + 4e-6)), 1e-9);
  EXPECT_NEAR(all.mean, edges_per_wavelength(mesh, wavelength), 1e-12);
  EXPECT_NEAR(all.least, wavelength / 2e-3, 1e-9);
  EXPECT_NEAR(all.least_5, wavelength / 2e-3, 1e-9);

  const auto fine = resolution_within(mesh, wavelength, Vector3::Zero(), 0.05);
  ASSERT_TRUE(fine);
  EXPECT_EQ(fine->faces, 200);
  EXPECT_NEAR(fine->mean, wavelength / 1e-3, 1e-9);
  EXPECT_NEAR(fine->least, wavelength / 1e-3, 1e-9);
  EXPECT_FALSE(resolution_within(mesh, wavelength, Vector3(0, 0, 1), 0.5));
  EXPECT_FALSE(resolution_within(mesh, wavelength, Vector3::Zero(), -1.0));
}

// On the sphere h depends on the distance d from the pole alone, and a ring has the area 2 pi d dd. A coarse
// triangulation of it (whose area is 1 % short) asks for the same number as a fine one.
TEST(WantedFaces, AreTheIntegralOverTheSurface) {
  const double radius = 10e-3;
  const EdgeSizing sizing(3e-3, {{Vector3(0, 0, radius), 0.5e-3, 2e-3}}, 0.3);
  double expected = 0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const double d = 2 * radius * (i + 0.5) / kSteps;
    const double h = std::min(3e-3, 0.5e-3 + 0.3 * std::max(0.0, d - 2e-3));
    expected += 2 * pi * d * (2 * radius / kSteps) * 4.0 / (std::sqrt(3.0) * h * h);
  }
  EXPECT_NEAR(wanted_faces(icosphere(radius, 60), sizing, 1e9) / expected, 1.0, 0.01);
  EXPECT_NEAR(wanted_faces(icosphere(radius, 6), sizing, 1e9) / expected, 1.0, 0.03);
}

TEST(WantedFaces, StopAtTheMost) {
  EXPECT_EQ(wanted_faces(right_triangle(1.0, 1.0), EdgeSizing(1e-6), 1000), 1000);
  // Patches of a body this large never get as small as the edges: the digits end before.
  const EdgeSizing graded(1e-3, {{Vector3::Zero(), 5e-4, 0.01}});
  EXPECT_EQ(wanted_faces(icosphere(1e27, 3), graded, 1000), 1000);
}

TEST(EdgeSizing, IsTheZonesInsideAndGrowsOutsideIt) {
  const Vector3 centre(0.01, -0.02, 0.03);
  const EdgeSizing sizing(3e-3, {{centre, 1e-3, 10e-3}}, 0.25);
  const Vector3 along = Vector3(1, 2, -2) / 3.0;
  EXPECT_EQ(sizing.at(centre), 1e-3);
  EXPECT_NEAR(sizing.at(Vector3(centre + 9.99e-3 * along)), 1e-3, 1e-15);
  EXPECT_NEAR(sizing.at(Vector3(centre + 14e-3 * along)), 1e-3 + 0.25 * 4e-3, 1e-15);
  EXPECT_NEAR(sizing.at(Vector3(centre + 17.9e-3 * along)), 1e-3 + 0.25 * 7.9e-3, 1e-15);
  EXPECT_EQ(sizing.at(Vector3(centre + 18.1e-3 * along)), 3e-3);
  EXPECT_EQ(sizing.finest(), 1e-3);
}

TEST(EdgeSizing, TakesTheFinestOfItsZonesAndNeverExceedsFar) {
  const EdgeSizing sizing(
      3e-3, {{Vector3(0, 0, 0), 2e-3, 10e-3}, {Vector3(5e-3, 0, 0), 1e-3, 1e-3}, {Vector3(1, 0, 0), 5e-3, 1}}, 0.2);
  EXPECT_EQ(sizing.at(Vector3(5e-3, 0, 0)), 1e-3);
  EXPECT_EQ(sizing.at(Vector3(-9e-3, 0, 0)), 2e-3);
  EXPECT_NEAR(sizing.at(Vector3(8e-3, 0, 0)), 1e-3 + 0.2 * 2e-3, 1e-15);
  EXPECT_EQ(sizing.at(Vector3(1, 0, 0)), 3e-3);
  EXPECT_EQ(sizing.finest(), 1e-3);
  EXPECT_EQ(EdgeSizing(1e-3, {{Vector3::Zero(), 2e-3, 1e-3}}).finest(), 1e-3);
}

constexpr double kRounding = 1e-15;  // [m] of bodies below a metre

TEST(SplitFaces, KeepsTheSurfaceAndStaysClosed) {
  for (const TriangleMesh& mesh : {box({0.02, 0.03, 0.01}, 5e-3).mesh, icosphere(0.03, 4)}) {
    const TriangleMesh split = split_faces(mesh);
    const MeshReport report = inspect(split);
    EXPECT_THAT(report.faults, IsEmpty());
    EXPECT_EQ(report.unused_vertices, 0);
    EXPECT_EQ(split.face_count(), 4 * mesh.face_count());
    EXPECT_EQ(split.vertex_count(), mesh.vertex_count() + 3 * mesh.face_count() / 2);
    EXPECT_EQ(split.vertices().leftCols(mesh.vertex_count()), mesh.vertices());
    EXPECT_NEAR(split.signed_volume() / mesh.signed_volume(), 1.0, 1e-12);
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      EXPECT_LT((split.centroids().col(4 * f + 3) - mesh.centroids().col(f)).norm(), kRounding);
      for (Eigen::Index child = 4 * f; child < 4 * f + 4; ++child) {
        EXPECT_NEAR(split.areas()(child) / mesh.areas()(f), 0.25, 1e-9);
        EXPECT_NEAR(split.normals().col(child).dot(mesh.normals().col(f)), 1.0, 1e-12);
      }
    }
  }
}

}  // namespace touchfield::mesh_quality_test
