#include "sim/mesh/inspect.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/mesh/shapes.h"

namespace touchfield {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

/// Cube with corners at 0 and 10 mm: corner number x + 2 y + 4 z.
TriangleMesh cube(const Vector3& at = Vector3::Zero()) {
  Points vertices(3, 8);
  for (int i = 0; i < 8; ++i) {
    vertices.col(i) = at + 0.01 * Eigen::Vector3i(i % 2, i / 2 % 2, i / 4).cast<double>();
  }
  Triangles triangles(3, 12);
  triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      3, 2, 5, 7, 1, 5, 7, 6, 6, 4, 3, 7,           //
      1, 3, 7, 6, 5, 4, 3, 7, 2, 6, 7, 5;
  return {vertices, triangles};
}

/// The meshes side by side, nothing merged.
TriangleMesh together(const TriangleMesh& one, const TriangleMesh& other) {
  Points vertices(3, one.vertex_count() + other.vertex_count());
  vertices << one.vertices(), other.vertices();
  Triangles triangles(3, one.face_count() + other.face_count());
  triangles << one.triangles(), (other.triangles().array() + static_cast<int>(one.vertex_count())).matrix();
  return {vertices, triangles};
}

TriangleMesh with_triangles(const TriangleMesh& mesh, const Triangles& triangles) {
  return {mesh.vertices(), triangles};
}

/// Vertex `gone` replaced by `kept` in all faces of the mesh.
TriangleMesh with_vertices_joined(const TriangleMesh& mesh, int kept, int gone) {
  return with_triangles(mesh, (mesh.triangles().array() == gone).select(kept, mesh.triangles()));
}

TEST(Inspect, CubeIsClosedAndMeasured) {
  const MeshReport report = inspect(cube());
  EXPECT_EQ(report.faces, 12);
  EXPECT_EQ(report.vertices, 8);
  EXPECT_EQ(report.unused_vertices, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_TRUE(report.closed());
  EXPECT_FALSE(report.inside_out);
  EXPECT_THAT(report.faults, IsEmpty());
  constexpr double kRounding = 1e-14;
  EXPECT_NEAR(report.area, 6e-4, kRounding);
  EXPECT_NEAR(report.volume, 1e-6, kRounding);
  EXPECT_NEAR(report.shortest_edge, 0.01, kRounding);
  EXPECT_NEAR(report.longest_edge, 0.01 * std::numbers::sqrt2, kRounding);
  EXPECT_NEAR(report.smallest_angle, std::numbers::pi / 4.0, kRounding);
  EXPECT_NO_THROW(require_closed_surface(cube(), "cube.stl"));
}

TEST(Inspect, CountsUnusedVertices) {
  Points vertices(3, 10);
  vertices << cube().vertices(), Points::Zero(3, 2);
  const MeshReport report = inspect(TriangleMesh(vertices, cube().triangles()));
  EXPECT_EQ(report.unused_vertices, 2);
  EXPECT_EQ(report.vertices, 10);
  EXPECT_THAT(report.faults, IsEmpty());
}

TEST(Inspect, FindsAHole) {
  const TriangleMesh open = with_triangles(cube(), cube().triangles().rightCols(11));  // without (0, 3, 1)
  const MeshReport report = inspect(open);
  EXPECT_EQ(report.boundary_edges, 3);
  EXPECT_FALSE(report.closed());
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(report.faults,
              ElementsAre("3 boundary edges (holes), the first between vertices 0 and 1 near (5.00, 0.00, 0.00) mm"));
}

TEST(Inspect, OneTriangleIsAllBoundary) {
  const MeshReport report = inspect(with_triangles(cube(), cube().triangles().leftCols(1)));
  EXPECT_EQ(report.boundary_edges, 3);
  EXPECT_EQ(report.unused_vertices, 5);
  EXPECT_FALSE(report.inside_out);
}

TEST(Inspect, FindsAFlippedFace) {
  Triangles triangles = cube().triangles();
  std::swap(triangles(0, 5), triangles(1, 5));
  const MeshReport report = inspect(with_triangles(cube(), triangles));
  EXPECT_EQ(report.misoriented_edges, 3);
  EXPECT_TRUE(report.closed());
  EXPECT_FALSE(report.inside_out);  // it is neither in nor out
  ASSERT_EQ(report.faults.size(), 1u);
  EXPECT_THAT(report.faults[0], HasSubstr("3 misoriented edges"));
}

TEST(Inspect, FindsAnInnerWall) {
  Triangles triangles(3, 13);
  triangles << cube().triangles(), Eigen::Vector3i(0, 3, 5);  // 0-3 and 0-5 are diagonals of sides, 3-5 is not
  const MeshReport report = inspect(with_triangles(cube(), triangles));
  EXPECT_EQ(report.nonmanifold_edges, 2);
  EXPECT_EQ(report.boundary_edges, 1);
  EXPECT_FALSE(report.closed());
}

TEST(Inspect, FindsCubesThatShareAnEdge) {
  // The edge from 1 to 5 of the first is that from 2 to 6 of the second (numbered from 8).
  TriangleMesh mesh = together(cube(), cube({0.01, -0.01, 0}));
  mesh = with_vertices_joined(with_vertices_joined(mesh, 1, 10), 5, 14);
  const MeshReport report = inspect(mesh);
  EXPECT_EQ(report.nonmanifold_edges, 1);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(report.faults, ElementsAre(AllOf(HasSubstr("1 non-manifold edge ("), HasSubstr("vertices 1 and 5"),
                                               HasSubstr("(10.00, 0.00, 5.00) mm"))));
}

TEST(Inspect, FindsCubesThatTouchInOnePoint) {
  const TriangleMesh mesh = with_vertices_joined(together(cube(), cube({0.01, 0.01, 0.01})), 7, 8);
  const MeshReport report = inspect(mesh);
  EXPECT_EQ(report.nonmanifold_vertices, 1);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.components, 2);
  EXPECT_THAT(report.faults, ElementsAre(AllOf(HasSubstr("1 non-manifold vertex"),
                                               HasSubstr("vertex 7 at (10.00, 10.00, 10.00) mm"))));
}

TEST(Inspect, FindsASurfaceInsideOut) {
  Triangles triangles = cube().triangles();
  triangles.row(0).swap(triangles.row(2));
  const MeshReport report = inspect(with_triangles(cube(), triangles));
  EXPECT_TRUE(report.inside_out);
  EXPECT_NEAR(report.volume, -1e-6, 1e-14);
  EXPECT_THAT(report.faults, ElementsAre(HasSubstr("1 piece inside out")));
}

TEST(Inspect, TakesSeveralPiecesEachOutward) {
  const MeshReport report = inspect(together(cube(), cube({0.02, 0, 0})));
  EXPECT_EQ(report.components, 2);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_NEAR(report.volume, 2e-6, 1e-14);
}

// The volume of the whole is positive; that of the second piece is not.
TEST(Inspect, FindsOnePieceInsideOut) {
  const TriangleMesh ball = icosphere(0.1, 2);
  Triangles triangles = cube().triangles();
  triangles.row(0).swap(triangles.row(2));
  const MeshReport report = inspect(together(ball, with_triangles(cube({0.2, 0, 0}), triangles)));
  EXPECT_TRUE(report.inside_out);
  EXPECT_THAT(report.faults, ElementsAre(AllOf(HasSubstr("1 piece inside out"), HasSubstr("face 80"))));
}

TEST(Inspect, FindsFacesBackToBack) {
  Triangles pillow(3, 2);
  pillow << 0, 0,  //
      1, 2,        //
      2, 1;
  const MeshReport report = inspect(with_triangles(cube(), pillow));
  EXPECT_TRUE(report.closed());
  EXPECT_THAT(report.faults, ElementsAre(HasSubstr("1 piece without volume")));
}

TEST(RequireClosedSurface, NamesTheMeshAndEveryFault) {
  Triangles triangles = cube().triangles();
  std::swap(triangles(0, 5), triangles(1, 5));
  const TriangleMesh broken = with_triangles(cube(), triangles.rightCols(11));
  EXPECT_THAT([&] { require_closed_surface(broken, "hands/mine.stl"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("hands/mine.stl: "), HasSubstr("3 boundary edges (holes)"),
                                              HasSubstr("misoriented edge"))));
}

}  // namespace
}  // namespace touchfield
