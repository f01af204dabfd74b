#include "sim/mesh/query/self_intersections.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <Eigen/LU>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/random_support.h"
#include "tests/support/testing.h"
#include "tests/support/threads_support.h"

namespace touchfield::self_intersections_test {

using Index = Eigen::Index;
using Pairs = std::vector<std::pair<Index, Index>>;

/// Whether the segment from p to q goes through the inside of a face of a mesh: p + t (q - p) = a + u (b - a) +
/// v (c - a).
bool goes_through(const Vector3& p, const Vector3& q, const TriangleMesh& mesh, Index f) {
  Eigen::Matrix3d matrix;
  matrix << mesh.corner(f, 1) - mesh.corner(f, 0), mesh.corner(f, 2) - mesh.corner(f, 0), p - q;
  const Vector3 solved = matrix.inverse() * (p - mesh.corner(f, 0));
  return solved.minCoeff() > 0 && solved(0) + solved(1) < 1 && solved(2) < 1;
}

/// Two faces in general position cut each other if an edge of one goes through the other.
bool cut_by_an_edge(const TriangleMesh& mesh, Index f, Index g) {
  for (const auto& [one, other] : {std::pair{f, g}, std::pair{g, f}}) {
    for (int c = 0; c < 3; ++c) {
      if (goes_through(mesh.corner(one, c), mesh.corner(one, (c + 1) % 3), mesh, other)) {
        return true;
      }
    }
  }
  return false;
}

/// Triangles about a third as large as the cube that they are in, each with corners of its own.
TriangleMesh soup(int faces, std::mt19937& random) {
  Points vertices(3, 3 * faces);
  Triangles triangles(3, faces);
  for (int f = 0; f < faces; ++f) {
    triangles.col(f) << 3 * f, 3 * f + 1, 3 * f + 2;
    vertices.col(3 * f) = point_in_cube(random);
    for (int c = 1; c < 3; ++c) {
      vertices.col(3 * f + c) = vertices.col(3 * f) + 0.6 * point_in_cube(random);
    }
  }
  return {vertices, triangles};
}

TEST(SelfIntersections, FindsWhatTheDirectSearchFinds) {
  std::mt19937 random(3);
  const TriangleMesh mesh = soup(700, random);
  Pairs expected;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (Index g = f + 1; g < mesh.face_count(); ++g) {
      if (cut_by_an_edge(mesh, f, g)) {
        expected.emplace_back(f, g);
      }
    }
  }
  EXPECT_GT(expected.size(), 2000u);
  EXPECT_EQ(self_intersections(mesh, 1000000), expected);
}

struct TwoFaces {
  std::string name;
  std::vector<Vector3> points;
  Eigen::Vector3i one;
  Eigen::Vector3i other;
  bool cut;
};

/// A face in the plane z = 0 with the corners 0, 1, 2 against others.
std::vector<TwoFaces> two_faces() {
  const Vector3 a(0, 0, 0);
  const Vector3 b(4, 0, 0);
  const Vector3 c(0, 4, 0);
  const auto own = [&](const std::string& name, const Vector3& d, const Vector3& e, const Vector3& f, bool cut) {
    return TwoFaces{name, {a, b, c, d, e, f}, {0, 1, 2}, {3, 4, 5}, cut};
  };
  const auto common_corner = [&](const std::string& name, const Vector3& d, const Vector3& e, bool cut) {
    return TwoFaces{name, {a, b, c, d, e}, {0, 1, 2}, {0, 3, 4}, cut};
  };
  const auto common_edge = [&](const std::string& name, const Vector3& d, bool cut) {
    return TwoFaces{name, {a, b, c, d}, {0, 1, 2}, {1, 0, 3}, cut};
  };
  return {
      own("through", {1, 1, -1}, {1, 1, 1}, {5, 5, 0.5}, true),
      own("tip through", {1, 1, -1e-6}, {1, 2, 1}, {2, 1, 1}, true),
      own("beside", {5, 5, -1}, {5, 5, 1}, {6, 6, 0}, false),
      own("past a corner, boxes meet", {3.5, 3.5, -1}, {3.5, 3.5, 1}, {2.5, 2.5, 1}, false),
      own("corner on the inside", {1, 1, 0}, {1, 2, 1}, {2, 1, 1}, false),
      own("edge on the inside", {1, 1, 0}, {1, 2, 0}, {2, 1, 1}, false),
      own("edge that leaves the inside", {1, 1, 0}, {7, 2, 0}, {2, 1, 1}, false),
      own("corner on a corner", {0, 0, 0}, {0, -1, 1}, {0, -1, -1}, false),
      own("edge on an edge, upright", {1, 0, 0}, {3, 0, 0}, {2, 0, 1}, false),
      own("edge on an edge, flat", {1, 0, 0}, {3, 0, 0}, {2, -1, 0}, false),
      own("edge on an edge, folded", {1, 0, 0}, {3, 0, 0}, {2, 1, 0}, true),
      own("edges cross", {2, 0, -1}, {2, 0, 1}, {2, -1, 0}, false),
      own("edge through an edge", {2, 0, -1}, {2, 0, 1}, {2, 1, 0}, true),
      own("flat, a part in common", {1, 1, 0}, {9, 1, 0}, {1, 9, 0}, true),
      own("flat, a star", {3, 3, 0}, {-1, 2, 0}, {2, -1, 0}, true),
      own("flat, a corner on an edge", {2, 2, 0}, {3, 2, 0}, {2, 3, 0}, false),
      own("flat, beside one edge only", {2.01, 2.01, 0}, {4, 2.2, 0}, {3, 5, 0}, false),
      own("the same", a, b, c, true),
      own("parallel, 1e-6 of its size above", {1, 1, 4e-6}, {2, 1, 4e-6}, {1, 2, 4e-6}, false),
      own("parallel, 1e-11 of its size above", {1, 1, 4e-11}, {2, 1, 4e-11}, {1, 2, 4e-11}, true),
      own("needle, through", {1, 1, -1}, {1, 1, 1}, {1, 1 + 1e-11, 0.5}, true),
      own("needle, on it", {1, 1, 0}, {1, 1, 1}, {1, 1 + 1e-11, 0.5}, false),
      own("needle, within", {1, 1, 0}, {2, 1, 0}, {1.5, 1 + 1e-11, 0}, true),
      common_corner("common corner, through", {2, 2, -1}, {2, 2, 1}, true),
      common_corner("common corner, the other's edge through", {0.5, 0.5, -1}, {0.5, 0.5, 1}, true),
      common_corner("common corner, upright beside", {1, -1, 1}, {1, -1, -1}, false),
      common_corner("common corner, on one side", {2, 2, 1}, {2, 1, 1}, false),
      common_corner("common corner, an edge on the inside", {1, 1, 0}, {2, 1, 1}, false),
      common_corner("common corner, flat beside", {-4, 0, 0}, {0, -4, 0}, false),
      common_corner("common corner, flat, edge on edge", {2, 0, 0}, {2, -2, 0}, false),
      common_corner("common corner, flat, an edge within", {1, 2, 0}, {-1, 1, 0}, true),
      common_corner("common corner, flat, within", {1, 0.5, 0}, {0.5, 1, 0}, true),
      common_corner("common corner, flat, an edge of both", {2, 0, 0}, {1, 1, 0}, true),
      common_edge("neighbour, flat", {2, -3, 0}, false),
      common_edge("neighbour, upright", {2, 0, 3}, false),
      common_edge("neighbour, folded to 1e-6", {2, 3, 3e-6}, false),
      common_edge("neighbour, folded within", {1, 1, 0}, true),
      TwoFaces{"the same corners", {a, b, c}, {0, 1, 2}, {1, 0, 2}, true},
  };
}

// Every way two faces can lie to each other, anywhere, at any scale, in any order of faces and corners.
TEST(SelfIntersections, KnowsTouchingFromCutting) {
  std::mt19937 random(5);
  for (const TwoFaces& each : two_faces()) {
    SCOPED_TRACE(each.name);
    for (int round = 0; round < 30; ++round) {
      const double scale = std::pow(10, uniform(random, -4, 0));
      const Eigen::Matrix3d rotation =
          round == 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : some_rotation(random);
      const Vector3 shift = 3 * scale * point_in_cube(random);
      Points points(3, static_cast<Index>(each.points.size()));
      for (std::size_t v = 0; v < each.points.size(); ++v) {
        points.col(static_cast<Index>(v)) = scale * rotation * each.points[v] + shift;
      }
      Triangles triangles(3, 2);
      triangles << each.one, each.other;
      for (auto face : triangles.colwise()) {
        std::shuffle(face.begin(), face.end(), random);
      }
      if (round % 2 == 1) {
        triangles.col(0).swap(triangles.col(1));
      }
      const TriangleMesh mesh(points, triangles);
      ASSERT_EQ(self_intersections(mesh).size(), each.cut ? 1u : 0u) << round;
      const TriangleMesh first(points, triangles.col(0));
      const TriangleMesh second(points, triangles.col(1));
      ASSERT_EQ(intersections(first, second).size(), each.cut ? 1u : 0u) << round;
    }
  }
}

/// As a file of single precision would have it.
TriangleMesh rounded(const TriangleMesh& mesh) {
  return {mesh.vertices().cast<float>().cast<double>(), mesh.triangles()};
}

// Flat and curved skins, turned and rounded: many neighbours in one plane, or nearly.
TEST(SelfIntersections, FindsNoneInSoundSkins) {
  std::mt19937 random(6);
  for (const TriangleMesh& mesh : {box({0.05, 0.04, 0.03}, 2e-3).mesh, sphere(0.03, 2e-3).mesh,
                                   capsule(0.01, 0.05, 2e-3).mesh, hand({.pose = "fist", .edge = 4e-3}).mesh}) {
    EXPECT_THAT(self_intersections(mesh), IsEmpty());
    const TriangleMesh turned = transformed(mesh, some_rotation(random), point_in_cube(random));
    EXPECT_THAT(self_intersections(turned), IsEmpty());
    EXPECT_THAT(self_intersections(rounded(turned)), IsEmpty());
  }
}

// What is left out depends neither on the number of threads nor on how many are found at a time.
TEST(SelfIntersections, StopsAfterTheFirst) {
  std::mt19937 random(8);
  const TriangleMesh mesh = soup(5000, random);
  for (const std::size_t most : {0u, 1u, 10u, 1000u}) {
    const auto find = [&] { return self_intersections(mesh, most); };
    const Pairs alone = with_threads(1, find);
    EXPECT_EQ(alone.size(), most);
    EXPECT_EQ(with_threads(4, find), alone);
    for (const auto& [f, g] : alone) {
      EXPECT_TRUE(cut_by_an_edge(mesh, f, g));
    }
  }
}

}  // namespace touchfield::self_intersections_test
