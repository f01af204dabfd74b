#include "sim/mesh/repair/fill_holes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/body/shapes.h"
#include "sim/core/errors.h"
#include "sim/mesh/query/inspect.h"

namespace touchfield {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

Triangles as_triangles(const std::vector<std::array<int, 3>>& faces) {
  Triangles triangles(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f) {
    triangles.col(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  }
  return triangles;
}

Triangles joined(const Triangles& one, const Triangles& other) {
  Triangles both(3, one.cols() + other.cols());
  both << one, other;
  return both;
}

/// The faces whose centroid does not satisfy the condition.
template <class Condition>
Triangles without(const TriangleMesh& mesh, const Condition& condition) {
  Triangles kept(3, mesh.face_count());
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (!condition(Vector3(mesh.centroids().col(f)))) {
      kept.col(count++) = mesh.triangles().col(f);
    }
  }
  return kept.leftCols(count);
}

TriangleMesh filled(const Points& points, const Triangles& open) {
  Triangles triangles = open;
  for (const std::vector<int>& loop : boundary_loops(open, static_cast<int>(points.cols()))) {
    triangles = joined(triangles, as_triangles(fill_loop(points, loop, open)));
  }
  return {points, triangles};
}

/// A star-shaped polygon in a tilted plane.
Points polygon(int corners, double inner) {
  Points points(3, corners);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    points.col(i) = turn * Vector3(std::cos(angle), std::sin(angle), 0.2) * (i % 2 == 0 ? 1.0 : inner);
  }
  return points;
}

std::vector<int> numbers(int count) {
  std::vector<int> all(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    all[static_cast<std::size_t>(i)] = i;
  }
  return all;
}

TEST(BoundaryLoops, RunAgainstTheFacesBesideThem) {
  EXPECT_THAT(boundary_loops(as_triangles({{0, 1, 2}}), 3), ElementsAre(ElementsAre(2, 1, 0)));
  const TriangleMesh sphere = icosphere(1.0, 3);
  EXPECT_THAT(boundary_loops(sphere.triangles(), static_cast<int>(sphere.vertex_count())), IsEmpty());
  EXPECT_THAT(boundary_loops(Triangles(3, 0), 0), IsEmpty());
}

// Two holes whose rims touch in vertex 0, and two sheets that touch there: each loop passes it once.
TEST(BoundaryLoops, PassNoVertexTwice) {
  const std::vector<std::vector<int>> sheets = boundary_loops(as_triangles({{0, 1, 2}, {0, 3, 4}}), 5);
  EXPECT_THAT(sheets, UnorderedElementsAre(UnorderedElementsAre(0, 1, 2), UnorderedElementsAre(0, 3, 4)));

  const TriangleMesh mesh = icosphere(1.0, 4);
  // Two faces of one vertex that share no edge with each other.
  std::vector<Eigen::Index> fan;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if ((mesh.triangles().col(f).array() == 0).any()) {
      const auto shares_edge = [&](Eigen::Index other) {
        int shared = 0;
        for (const int v : mesh.triangles().col(f)) {
          shared += (mesh.triangles().col(other).array() == v).any() ? 1 : 0;
        }
        return shared > 1;
      };
      if (std::none_of(fan.begin(), fan.end(), shares_edge)) {
        fan.push_back(f);
      }
    }
  }
  ASSERT_GE(fan.size(), 2u);
  const Vector3 first = mesh.centroids().col(fan[0]);
  const Vector3 second = mesh.centroids().col(fan[1]);
  const Triangles open = without(mesh, [&](const Vector3& at) { return at == first || at == second; });
  const auto loops = boundary_loops(open, static_cast<int>(mesh.vertex_count()));
  EXPECT_THAT(loops, ElementsAre(SizeIs(3), SizeIs(3)));
  EXPECT_THAT(inspect(filled(mesh.vertices(), open)).faults, IsEmpty());
}

TEST(BoundaryLoops, RefusesWhatIsNotOriented) {
  EXPECT_THAT(
      [] {
        boundary_loops(as_triangles({{0, 1, 2}, {0, 1, 3}}), 4);
      },
      ThrowsMessage<InputError>(HasSubstr("run the same way")));
  EXPECT_THAT([] { boundary_loops(as_triangles({{0, 1, 1}}), 2); }, ThrowsMessage<InputError>(HasSubstr("twice")));
}

// A polygon's triangulation has its area, and every normal is the polygon's, only if nothing overlaps.
TEST(FillLoop, TriangulatesFlatPolygons) {
  for (const double inner : {1.0, 0.3}) {
    for (const int corners : {3, 4, 12, 60}) {
      if (inner < 1 && corners < 8) {
        continue;
      }
      const Points points = polygon(corners, inner);
      const auto faces = fill_loop(points, numbers(corners));
      ASSERT_THAT(faces, SizeIs(static_cast<std::size_t>(corners - 2)));
      const TriangleMesh mesh(points, as_triangles(faces));
      // Two of the `corners` triangles about the middle: radii 1 and `inner`.
      const double area = 0.5 * corners * inner * std::sin(2 * std::numbers::pi / corners);
      if (inner == 1.0) {
        EXPECT_NEAR(mesh.total_area(), area, 1e-9);
      }
      const Vector3 normal = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()) * Vector3::UnitZ();
      if (inner == 1.0) {
        EXPECT_GT((normal.transpose() * mesh.normals()).minCoeff(), 1 - 1e-9);
      }
    }
  }
}

// Points along a side must not make faces without area: a square with 4 points a side has other ways.
TEST(FillLoop, AvoidsFacesWithoutArea) {
  Points points(3, 16);
  for (int i = 0; i < 16; ++i) {
    const double along = i % 4;
    const std::array<Vector3, 4> sides = {Vector3(along, 0, 0), Vector3(4, along, 0), Vector3(4 - along, 4, 0),
                                          Vector3(0, 4 - along, 0)};
    points.col(i) = sides[static_cast<std::size_t>(i / 4)];
  }
  const TriangleMesh mesh(points, as_triangles(fill_loop(points, numbers(16))));
  EXPECT_NEAR(mesh.total_area(), 16.0, 1e-12);
  EXPECT_GT(mesh.normals().row(2).minCoeff(), 1 - 1e-12);
}

// The two diagonals of a bent square bend equally, a ridge or a valley; beside a face that rises outwards at 45 degrees
// the valley goes on best.
TEST(FillLoop, BendsLittleAlsoAgainstItsNeighbours) {
  Points points(3, 5);
  points << 0, 1, 1, 0, 0.5,  //
      0, 0, 1, 1, -0.5,       //
      0, 0.2, 0, 0.2, 0.6;
  const auto faces = fill_loop(points, {0, 1, 2, 3}, as_triangles({{1, 0, 4}}));
  std::vector<std::vector<int>> sets;
  for (const auto& face : faces) {
    sets.emplace_back(face.begin(), face.end());
  }
  EXPECT_THAT(sets, UnorderedElementsAre(UnorderedElementsAre(0, 1, 2), UnorderedElementsAre(0, 2, 3)));
}

// A tetrahedron with a flat roof of two faces taken off: filled by the diagonal that is there already, it would fold.
TEST(FillLoop, UsesNoEdgeOfTheSurfaceAgain) {
  Points points(3, 5);
  points << 0, 1, 1, 0, 0.5,  //
      0, 0, 1, 1, 0.5,        //
      0, 0.01, 0, 0.01, -1;
  // Below the loop 0 1 2 3: faces to vertex 4, but 0-2 joined instead of 4 on one side.
  const Triangles open = as_triangles({{1, 0, 2}, {0, 4, 2}, {2, 4, 3}, {3, 4, 0}});
  const auto loops = boundary_loops(open, 5);
  ASSERT_THAT(loops, ElementsAre(UnorderedElementsAre(0, 1, 2, 3)));
  const auto faces = fill_loop(points, loops[0], open);
  for (const auto& face : faces) {
    const bool has_both = std::count(face.begin(), face.end(), 0) + std::count(face.begin(), face.end(), 2) == 2;
    EXPECT_FALSE(has_both);
  }
  EXPECT_EQ(inspect({points, joined(open, as_triangles(faces))}).nonmanifold_edges, 0);
}

TEST(FillLoop, ClosesHolesInASphere) {
  const TriangleMesh sphere = icosphere(1.0, 12);
  const Triangles open = without(sphere, [](const Vector3& at) {
    return (at - Vector3(0, 0, 1)).norm() < 0.4 || (at - Vector3(1, 0, 0)).norm() < 0.3 ||
           (at - Vector3(0, -1, 0)).norm() < 0.15;
  });
  EXPECT_THAT(boundary_loops(open, static_cast<int>(sphere.vertex_count())), SizeIs(3));
  const TriangleMesh closed = filled(sphere.vertices(), open);
  const MeshReport report = inspect(closed);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.misoriented_edges, 0);
  EXPECT_EQ(report.nonmanifold_edges, 0);
  // Flat lids cut caps of height h off: pi h^2 (1 - h / 3) each, h = d^2 / 2 for a rim at distance d from the pole.
  const auto cap = [](double d) { return std::numbers::pi * std::pow(d * d / 2, 2) * (1 - d * d / 6); };
  EXPECT_NEAR(closed.signed_volume(), sphere.signed_volume() - cap(0.4) - cap(0.3) - cap(0.15), 0.01);
}

TEST(FillLoop, RefusesLoopsThatAreTooLarge) {
  Points points = Points::Random(3, 2001);
  EXPECT_THAT([&] { fill_loop(points, numbers(2001)); }, ThrowsMessage<InputError>(HasSubstr("2001 edges")));
  EXPECT_THROW(fill_loop(points, {0, 1}), InputError);
}

}  // namespace
}  // namespace touchfield
