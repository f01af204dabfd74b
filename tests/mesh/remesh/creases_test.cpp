#include "sim/mesh/remesh/creases.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "tests/support/testing.h"

namespace touchfield::creases_test {

using std::numbers::pi;

constexpr double kDegree = pi / 180.0;

auto everywhere(double length) {
  return [length](const Points& points) { return Eigen::VectorXd(Eigen::VectorXd::Constant(points.cols(), length)); };
}

/// A cone on its base, its tip upwards.
TriangleMesh cone(double radius, double height, int n) {
  Points points(3, n + 2);
  Triangles triangles(3, 2 * n);
  for (int i = 0; i < n; ++i) {
    const double turn = 2 * pi * i / n;
    points.col(i) << radius * std::cos(turn), radius * std::sin(turn), 0;
    triangles.col(2 * i) << n, (i + 1) % n, i;
    triangles.col(2 * i + 1) << n + 1, i, (i + 1) % n;
  }
  points.col(n) << 0, 0, 0;
  points.col(n + 1) << 0, 0, height;
  return {points, triangles};
}

double length_of(const TriangleMesh& mesh, const Crease& crease) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < crease.vertices.size(); ++i) {
    length += (mesh.vertices().col(crease.vertices[i + 1]) - mesh.vertices().col(crease.vertices[i])).norm();
  }
  return length;
}

// A box has twelve, however finely it is meshed and whatever edge is wanted of it.
TEST(Creases, OfABoxAreItsEdges) {
  for (const double edge : {10.0, 0.3}) {
    for (const double wanted : {0.1, 1.0}) {
      const TriangleMesh mesh = box({2, 3, 4}, edge).mesh;
      std::vector<double> lengths;
      for (const Crease& crease : find_creases(mesh, 50 * kDegree, everywhere(wanted))) {
        lengths.push_back(std::round(length_of(mesh, crease) * 1e9) * 1e-9);
        EXPECT_FALSE(crease.ring());
      }
      std::sort(lengths.begin(), lengths.end());
      EXPECT_THAT(lengths, ElementsAre(2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4)) << edge << " " << wanted;
    }
  }
}

TEST(Creases, CountByTheirAngle) {
  const TriangleMesh mesh = box({2, 3, 4}, 10).mesh;
  EXPECT_EQ(find_creases(mesh, 89.9 * kDegree, everywhere(1.0)).size(), 12u);
  EXPECT_THAT(find_creases(mesh, 90.1 * kDegree, everywhere(1.0)), IsEmpty());
  EXPECT_THAT(find_creases(icosphere(1.0, 3), 50 * kDegree, everywhere(0.1)), IsEmpty());
}

// What holds a vertex of a crease must end the crease: lengths along it are counted from its ends.
TEST(Creases, EndAtTips) {
  const TriangleMesh mesh = cone(1, 0.2, 24);
  const std::vector<Crease> rings = find_creases(mesh, 50 * kDegree, everywhere(0.3), {7});
  ASSERT_EQ(rings.size(), 1u);
  EXPECT_EQ(rings[0].vertices.front(), 7);
  EXPECT_EQ(rings[0].vertices.back(), 7);
  EXPECT_EQ(find_creases(mesh, 50 * kDegree, everywhere(0.3), {7, 12}).size(), 2u);
}

// The rim of a cone's base is one ring. Of 12 sides it turns by 30 degrees at each corner; of 5 by 72: a crease each.
TEST(Creases, TurnAtCorners) {
  const auto rim = [](int n) {  // flat enough for its sides to meet smoothly
    return find_creases(cone(1.0, 1.0, n), 60 * kDegree, everywhere(0.2));
  };
  const std::vector<Crease> round = rim(12);
  ASSERT_EQ(round.size(), 1u);
  EXPECT_TRUE(round[0].ring());
  EXPECT_EQ(round[0].vertices.size(), 13u);
  const std::vector<Crease> pointed = rim(5);
  EXPECT_EQ(pointed.size(), 5u);
  for (const Crease& crease : pointed) {
    EXPECT_EQ(crease.vertices.size(), 2u);
  }
}

// A cone with half the opening t leaves out a share 1 - sin(t) of the full turn: a quarter at 48.6 degrees.
TEST(Tips, AreWhereTheSkinComesToAPoint) {
  const auto tips = [](double half_opening) {
    return find_tips(cone(1.0, 1.0 / std::tan(half_opening), 60), everywhere(0.2));
  };
  EXPECT_THAT(tips(10 * kDegree), ElementsAre(61));
  EXPECT_THAT(tips(45 * kDegree), ElementsAre(61));
  EXPECT_THAT(tips(52 * kDegree), IsEmpty());
  EXPECT_THAT(find_tips(icosphere(1.0, 4), everywhere(0.2)), IsEmpty());
}

// A peak much smaller than the wanted edge is roughness, no tip.
TEST(Tips, AreNoneWhereASmallPeakStandsOnAFlatSide) {
  const TriangleMesh flat = box({2, 2, 2}, 0.1).mesh;
  Eigen::Index top = 0;
  Points points = flat.vertices();
  (points.colwise() - Vector3(0, 0, 1)).colwise().norm().minCoeff(&top);
  points(2, top) += 0.3;
  const TriangleMesh peaked(points, flat.triangles());
  EXPECT_EQ(find_tips(peaked, everywhere(0.1)).size(), 9u);  // with the corners of the box
  EXPECT_EQ(find_tips(peaked, everywhere(2.0)).size(), 8u);
}

TEST(Polyline, IsMeasuredAlongItself) {
  Points points(3, 3);
  points << 0, 3, 3,  //
      0, 0, 4,        //
      0, 0, 0;
  const Polyline line(points);
  EXPECT_EQ(line.length(), 7);
  EXPECT_EQ(line.length_to(1), 3);
  EXPECT_EQ(line.at(0), Vector3(0, 0, 0));
  EXPECT_EQ(line.at(1.5), Vector3(1.5, 0, 0));
  EXPECT_EQ(line.at(3), Vector3(3, 0, 0));
  EXPECT_EQ(line.at(5), Vector3(3, 2, 0));
  EXPECT_EQ(line.at(7), Vector3(3, 4, 0));
  EXPECT_EQ(line.at(-1), Vector3(0, 0, 0));
  EXPECT_EQ(line.at(8), Vector3(3, 4, 0));
}

TEST(Splinters, AreNoneInAFineMesh) {
  const TriangleMesh ball = icosphere(1.0, 20);  // edges of 0.06
  const TriangleMesh same = without_splinters(ball, everywhere(0.02));
  EXPECT_TRUE(same.triangles() == ball.triangles());
  EXPECT_TRUE(same.vertices() == ball.vertices());
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
  EXPECT_EQ(find_creases(good, 50 * kDegree, everywhere(0.5)).size(), 12u);
}

// A plate thinner than that stays a plate.
TEST(Splinters, AreNotThinParts) {
  const TriangleMesh plate = box({2, 2, 0.01}, 0.5).mesh;
  const TriangleMesh same = without_splinters(plate, everywhere(0.02));
  EXPECT_NEAR(same.signed_volume() / 0.04, 1.0, 1e-12);
  EXPECT_THAT(inspect(same).faults, IsEmpty());
}

}  // namespace touchfield::creases_test
