#include "sim/mesh/remesh/surface_remesh.h"

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/creases.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/topology.h"
#include "tests/support/mesh_support.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"
#include "tests/support/threads_support.h"

namespace touchfield::surface_remesh_test {

using std::numbers::pi;

constexpr double kMm = 1e-3;
constexpr double kDegree = pi / 180.0;

double uniform(std::mt19937_64& random, double least, double most) {
  return least + (most - least) * static_cast<double>(random() >> 11) / 9007199254740992.0;  // 2^53
}

Eigen::Index euler_characteristic(const TriangleMesh& mesh) { return mesh.vertex_count() - mesh.face_count() / 2; }

/// Sum of the lengths of the edges whose faces are more than an angle apart.
double sharp_length(const TriangleMesh& mesh, double angle) {
  const EdgeTable edges = edge_table(mesh.triangles());
  std::vector<Eigen::Index> first(static_cast<std::size_t>(edges.ends.cols()), -1);
  double length = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (const int e : edges.of_face.col(f)) {
      Eigen::Index& other = first[static_cast<std::size_t>(e)];
      if (other < 0) {
        other = f;
      } else if (mesh.normals().col(f).dot(mesh.normals().col(other)) < std::cos(angle)) {
        length += (mesh.vertices().col(edges.ends(1, e)) - mesh.vertices().col(edges.ends(0, e))).norm();
      }
    }
  }
  return length;
}

/// A cylinder of n sides along z with caps: long quads cut in two, and fans.
TriangleMesh cylinder(double radius, double length, int n) {
  Points points(3, 2 * n + 2);
  Triangles triangles(3, 4 * n);
  for (int i = 0; i < n; ++i) {
    const double turn = 2 * pi * i / n;
    const int next = (i + 1) % n;
    points.col(i) << radius * std::cos(turn), radius * std::sin(turn), 0;
    points.col(n + i) << radius * std::cos(turn), radius * std::sin(turn), length;
    triangles.col(4 * i) << i, next, n + next;
    triangles.col(4 * i + 1) << i, n + next, n + i;
    triangles.col(4 * i + 2) << 2 * n, next, i;
    triangles.col(4 * i + 3) << 2 * n + 1, n + i, n + next;
  }
  points.col(2 * n) << 0, 0, 0;
  points.col(2 * n + 1) << 0, 0, length;
  return {points, triangles};
}

void expect_sound(const TriangleMesh& mesh, const TriangleMesh& original) {
  EXPECT_THAT(inspect(mesh).faults, IsEmpty());
  EXPECT_EQ(inspect(mesh).components, inspect(original).components);
  EXPECT_EQ(inspect(mesh).unused_vertices, 0);
  EXPECT_EQ(euler_characteristic(mesh), euler_characteristic(original));
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
}

// Creases hold all corners of a face without area, which no collapse may then remove and no normal lets flip.
TEST(SurfaceRemesh, LeavesNoFaceWithoutArea) {
  const TriangleMesh whole = cube();
  Points vertices(3, 9);
  vertices << whole.vertices(), Vector3(0.005, 0.005, 0.01);  // on the diagonal 4-7 of faces 2 and 3
  Triangles triangles(3, 14);
  triangles << whole.triangles(), Eigen::Vector3i(5, 7, 8), Eigen::Vector3i(4, 8, 7);
  triangles.col(2) << 4, 5, 8;
  const CreasedTarget target{[](const Points& points) { return Eigen::VectorXd::Constant(points.cols(), 0.011); },
                             [](Points&, const Points&, const Points&) {},
                             {{{4, 8}}, {{8, 7}}},
                             {0, 1, 2, 3, 5, 6}};
  const CreasedMesh result = remeshed(vertices, triangles, target, 1);
  EXPECT_EQ(result.mesh.face_count(), 14);
  EXPECT_NEAR(result.mesh.signed_volume(), 1e-6, 1e-15);
}

// 12 faces with edges of 20 to 50 mm, or 48,000 of half a millimetre: the same box.
TEST(SurfaceRemesh, KeepsTheShapeOfABoxExactly) {
  const Vector3 size(20 * kMm, 30 * kMm, 40 * kMm);
  const EdgeSizing sizing(1.4 * kMm);
  for (const double edge : {50 * kMm, 0.5 * kMm}) {
    const TriangleMesh original = box(size, edge).mesh;
    const TriangleMesh mesh = remeshed_surface(original, sizing);
    expect_sound(mesh, original);
    EXPECT_NEAR(mesh.signed_volume() / size.prod(), 1.0, 1e-12);
    EXPECT_NEAR(mesh.total_area() / (2 * (20 * 30 + 30 * 40 + 40 * 20) * 1e-6), 1.0, 1e-12);
    EXPECT_NEAR(sharp_length(mesh, 89 * kDegree) / (4 * size.sum()), 1.0, 1e-12) << "all 12 edges, whole";
    const Eigen::Array3Xd share = mesh.vertices().array().abs().colwise() / (0.5 * size).array();
    EXPECT_NEAR(share.colwise().maxCoeff().minCoeff(), 1.0, 1e-12) << "no vertex inside";
    EXPECT_EQ((share.colwise().minCoeff() > 1 - 1e-12).count(), 8) << "the corners";
    EXPECT_GE(edge_fit(mesh, sizing).share, 0.99);
    EXPECT_NEAR(edge_fit(mesh, sizing).mean_log, 0, 0.05);
    EXPECT_GT(inspect(mesh).smallest_angle, 15 * kDegree);
  }
}

TEST(SurfaceRemesh, FollowsAZoneOnABox) {
  const Vector3 top(0, 0, 20 * kMm);
  const EdgeSizing sizing(4 * kMm, {{top, 0.7 * kMm, 5 * kMm}});
  const TriangleMesh original = box({20 * kMm, 30 * kMm, 40 * kMm}, 50 * kMm).mesh;
  const TriangleMesh mesh = remeshed_surface(original, sizing);
  expect_sound(mesh, original);
  EXPECT_NEAR(mesh.signed_volume() / 24e-6, 1.0, 1e-12);
  EXPECT_NEAR(static_cast<double>(mesh.face_count()) / wanted_faces(original, sizing, 1e6), 1.0, 0.1);
  EXPECT_GE(edge_fit(mesh, sizing).share, 0.99);
  EXPECT_NEAR(resolution_within(mesh, 0.7 * kMm, top, 4.5 * kMm)->mean, 1.0, 0.06);
}

// The faces cut below a sphere of radius R by edge^2 / (12 R) in the mean; the lift makes up for it.
TEST(SurfaceRemesh, KeepsTheVolumeOfAFineSphereAndItsAreaToSecondOrder) {
  const double radius = 10 * kMm;
  const TriangleMesh original = icosphere(radius, 40);
  std::array<double, 2> area_error{};
  for (std::size_t i = 0; i < 2; ++i) {
    const EdgeSizing sizing(i == 0 ? 3 * kMm : 1.2 * kMm);
    const TriangleMesh mesh = remeshed_surface(original, sizing);
    expect_sound(mesh, original);
    EXPECT_NEAR(mesh.signed_volume() / original.signed_volume(), 1.0, i == 0 ? 2e-3 : 2e-4);
    area_error[i] = std::abs(mesh.total_area() / original.total_area() - 1.0);
    EXPECT_GE(edge_fit(mesh, sizing).share, 0.99);
    EXPECT_GT(inspect(mesh).smallest_angle, 25 * kDegree);
    EXPECT_NEAR(static_cast<double>(mesh.face_count()) / wanted_faces(original, sizing, 1e6), 1.0, 0.05);
  }
  EXPECT_GT(area_error[0] / area_error[1], 3.5);  // of (3 / 1.2)^2 = 6.3
  EXPECT_LT(area_error[0] / area_error[1], 10.0);
}

TEST(SurfaceRemesh, KeepsTheRimsOfCaps) {
  const double radius = 7.5 * kMm;
  const double length = 60 * kMm;
  const TriangleMesh original = cylinder(radius, length, 48);
  const TriangleMesh mesh = remeshed_surface(original, EdgeSizing(1.4 * kMm));
  expect_sound(mesh, original);
  // A chord of 1.4 mm is 0.15 % shorter than its arc.
  EXPECT_NEAR(sharp_length(mesh, 60 * kDegree) / (4 * pi * radius), 1.0, 4e-3);
  EXPECT_NEAR(mesh.signed_volume() / original.signed_volume(), 1.0, 2e-3);
  constexpr double kRounding = 1e-15;
  EXPECT_NEAR(mesh.vertices().row(2).minCoeff(), 0, kRounding);
  EXPECT_NEAR(mesh.vertices().row(2).maxCoeff(), length, kRounding);
  // The caps are flat up to the rim: no vertex near an end is anywhere but on the end, the rim or the side.
  const double inner = radius * std::cos(pi / 48);
  for (const auto& x : mesh.vertices().colwise()) {
    if (std::hypot(x.x(), x.y()) < 0.98 * inner) {
      EXPECT_TRUE(x.z() < kRounding || x.z() > length - kRounding) << x.transpose();
    }
  }
  EXPECT_GT(inspect(mesh).smallest_angle, 15 * kDegree);
  // Without creases the rims are rounded off.
  EXPECT_LT(sharp_length(remeshed_surface(original, EdgeSizing(1.4 * kMm), pi), 60 * kDegree), 3 * pi * radius);
}

// Noise of a third of its edges makes thousands of edges sharp; over a wanted edge it is smooth.
TEST(SurfaceRemesh, TakesNoCreasesFromNoise) {
  const TriangleMesh ball = icosphere(10 * kMm, 50);
  std::mt19937_64 random(3);
  Points points = ball.vertices();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    points.col(i) += 0.08 * kMm * Vector3(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
  }
  const TriangleMesh original(points, ball.triangles());
  ASSERT_GT(sharp_length(original, kCreaseAngle), 50 * kMm);
  const TriangleMesh mesh = remeshed_surface(original, EdgeSizing(1.4 * kMm));
  expect_sound(mesh, original);
  EXPECT_NEAR(mesh.signed_volume() / ball.signed_volume(), 1.0, 5e-3);
  EXPECT_GT(inspect(mesh).smallest_angle, 25 * kDegree);
  EXPECT_GE(edge_fit(mesh, EdgeSizing(1.4 * kMm)).share, 0.99);
}

// Plates as thick as the edges are long, 1 mm apart.
TEST(SurfaceRemesh, DoesNotJumpAcrossGapsAndThinParts) {
  const TriangleMesh plate = box({30 * kMm, 30 * kMm, 1.5 * kMm}, 50 * kMm).mesh;
  const TriangleMesh original = together(plate, shifted(plate, {0, 0, 2.5 * kMm}));
  const TriangleMesh mesh = remeshed_surface(original, EdgeSizing(1.4 * kMm));
  expect_sound(mesh, original);
  EXPECT_NEAR(mesh.signed_volume() / original.signed_volume(), 1.0, 1e-9);
  EXPECT_NEAR(mesh.total_area() / original.total_area(), 1.0, 1e-9);
}

TEST(SurfaceRemesh, DoesNotDependOnTheNumberOfThreads) {
  const TriangleMesh original = together(cylinder(7 * kMm, 30 * kMm, 30), shifted(icosphere(8 * kMm, 4), {0.05, 0, 0}));
  const TriangleMesh one = with_threads(1, [&] { return remeshed_surface(original, EdgeSizing(2 * kMm)); });
  const TriangleMesh other = with_threads(5, [&] { return remeshed_surface(original, EdgeSizing(2 * kMm)); });
  ASSERT_EQ(one.vertex_count(), other.vertex_count());
  EXPECT_TRUE(one.vertices() == other.vertices());
  EXPECT_TRUE(one.triangles() == other.triangles());
}

TEST(SurfaceRemesh, RefusesWhatItCannotMesh) {
  const TriangleMesh ball = icosphere(10 * kMm, 3);
  const EdgeSizing sizing(1.4 * kMm);
  const auto remesh = [&](const Triangles& triangles) {
    return [&ball, &sizing, triangles] { remeshed_surface(TriangleMesh(ball.vertices(), triangles), sizing); };
  };
  EXPECT_THAT(remesh(ball.triangles().leftCols(100)), ThrowsMessage<InputError>(HasSubstr("boundary edge")));
  Triangles flipped = ball.triangles();
  std::swap(flipped(0, 3), flipped(1, 3));
  EXPECT_THAT(remesh(flipped), ThrowsMessage<InputError>(HasSubstr("misoriented")));
  // Two balls that share one vertex.
  const TriangleMesh pair = together(ball, shifted(ball, {0.1, 0, 0}));
  Triangles pinched = pair.triangles();
  pinched = (pinched.array() == static_cast<int>(ball.vertex_count())).select(0, pinched);
  EXPECT_THROW(remeshed_surface(TriangleMesh(pair.vertices(), pinched), sizing), InputError);

  // As when a file in millimetres was read as metres.
  const TriangleMesh huge(1000 * ball.vertices(), ball.triangles());
  EXPECT_THAT([&] { remeshed_surface(huge, sizing); }, ThrowsMessage<InputError>(HasSubstr("more than 5000000 faces")));
  // A rod half as thick as the edges are long.
  EXPECT_THROW(remeshed_surface(cylinder(0.35 * kMm, 60 * kMm, 24), sizing), NumericalError);
}

auto everywhere(double length) {
  return [length](const Points& points) { return Eigen::VectorXd(Eigen::VectorXd::Constant(points.cols(), length)); };
}

// Needles: an edge split right beside its end. Caps: a vertex put next to the middle of an edge, out of the face's
// plane.
TEST(Splinters, AreTakenOut) {
  const TriangleMesh cube = box({2, 2, 2}, 0.5).mesh;
  Points points = cube.vertices();
  Triangles triangles = cube.triangles();
  for (const double along : {1e-3, 0.5}) {
    // Face 0 and its neighbour across the edge a, b: v near that edge, in face 0.
    const Eigen::Vector3i face = triangles.col(0);
    const Vector3 a = points.col(face(0));
    const Vector3 b = points.col(face(1));
    const Vector3 c = points.col(face(2));
    const Vector3 normal = (b - a).cross(c - a).normalized();
    const auto v = static_cast<int>(points.cols());
    points.conservativeResize(3, v + 1);
    points.col(v) = a + along * (b - a) + 1e-4 * (c - a) + 1e-4 * normal;
    const Eigen::Index count = triangles.cols();
    triangles.conservativeResize(3, count + 2);
    triangles.col(0) << face(0), face(1), v;
    triangles.col(count) << face(1), face(2), v;
    triangles.col(count + 1) << face(2), face(0), v;
  }
  const TriangleMesh bad(points, triangles);
  ASSERT_LT(inspect(bad).smallest_angle, 0.1 * kDegree);
  const TriangleMesh good = without_splinters(bad, everywhere(0.02));
  EXPECT_THAT(inspect(good).faults, IsEmpty());
  EXPECT_EQ(good.vertex_count() - good.face_count() / 2, 2);
  EXPECT_GT(inspect(good).smallest_angle, 5 * kDegree);
  EXPECT_NEAR(good.signed_volume() / 8.0, 1.0, 1e-4);
  EXPECT_EQ(find_creases(good, 50 * kDegree, everywhere(0.5)).size(), 12u);  // the box's edges
}

}  // namespace touchfield::surface_remesh_test
