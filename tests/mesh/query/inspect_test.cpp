#include "sim/mesh/query/inspect.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "sim/hand/shapes.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "tests/support/mesh_support.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"

namespace touchfield::inspect_test {

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
              ElementsAre("3 boundary edges (1 hole of 34.14 mm), the first between vertices 0 and 1 near "
                          "(5.00, 0.00, 0.00) mm"));
  ASSERT_EQ(report.holes.size(), 1u);
  EXPECT_EQ(report.holes[0].edges, 3);
  EXPECT_NEAR(report.holes[0].length, 0.02 + 0.01 * std::numbers::sqrt2, 1e-14);
  // Middles of the sides: (5, 5), (10, 5), (5, 0) mm.
  EXPECT_NEAR((report.holes[0].at - Vector3(0.02 / 3, 0.01 / 3, 0)).norm(), 0, 1e-14);
}

TEST(Inspect, ListsHolesTheLongestFirst) {
  Triangles triangles(3, 9);  // without (0 3 1), and without (4 5 7), (4 7 6), the side opposite
  triangles << cube().triangles().col(1), cube().triangles().rightCols(8);
  const MeshReport report = inspect(with_triangles(cube(), triangles));
  EXPECT_EQ(report.boundary_edges, 7);
  ASSERT_EQ(report.holes.size(), 2u);
  EXPECT_EQ(report.holes[0].edges, 4);
  EXPECT_NEAR(report.holes[0].length, 0.04, 1e-14);
  EXPECT_EQ(report.holes[1].edges, 3);
  EXPECT_THAT(report.faults, ElementsAre(HasSubstr("7 boundary edges (2 holes, the longest of 40.00 mm)")));
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

TEST(Inspect, FindsASurfaceInsideAnother) {
  const TriangleMesh outer = icosphere(0.1, 2);
  const TriangleMesh inner = icosphere(0.05, 1);
  for (const TriangleMesh& mesh : {together(outer, inner), together(inner, outer)}) {
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.nested_pieces, 1);
    EXPECT_FALSE(report.inside_out);
    EXPECT_THAT(report.faults, ElementsAre(HasSubstr("1 piece inside another")));
  }
  const MeshReport three = inspect(together(together(outer, inner), icosphere(0.01, 1)));
  EXPECT_EQ(three.nested_pieces, 2);
  // The inner surface of a shell looks inwards.
  Triangles inwards = inner.triangles();
  inwards.row(0).swap(inwards.row(1));
  const MeshReport shell = inspect(together(outer, with_triangles(inner, inwards)));
  EXPECT_EQ(shell.nested_pieces, 1);
  EXPECT_TRUE(shell.inside_out);
}

// A bar that sticks out of a ball, its first, middle and last faces in it.
TEST(Inspect, WhatSticksOutIsNotInside) {
  const TriangleMesh ball = icosphere(0.03, 6);
  const TriangleMesh bar = shifted(box({0.01, 0.1, 0.01}, 3e-3).mesh, {0.001, 0.06, 0.002});
  std::vector<Eigen::Index> order(static_cast<std::size_t>(bar.face_count()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(),
            [&](Eigen::Index f, Eigen::Index g) { return bar.centroids()(1, f) < bar.centroids()(1, g); });
  ASSERT_LT(bar.centroids().col(order[2]).norm(), 0.028);
  std::swap(order[1], order[order.size() / 2]);
  std::swap(order[2], order.back());
  const TriangleMesh pair = together(ball, with_triangles(bar, bar.triangles()(Eigen::all, order)));
  EXPECT_EQ(inspect(pair).nested_pieces, 0);
  // Nor is it where every centroid is: a spike whose corner alone is outside.
  Points spike(3, 4);
  spike << 0, 0.005, -0.005, 0,  //
      0, 0, 0, 0.04,             //
      0, 0.005, 0.005, 0.0025;
  Triangles faces(3, 4);
  faces << 2, 1, 2, 0,  //
      0, 0, 1, 2,       //
      1, 3, 3, 3;
  const TriangleMesh thorn(spike, faces);
  ASSERT_GT(thorn.signed_volume(), 0);
  ASSERT_LT(thorn.centroids().colwise().norm().maxCoeff(), 0.028);
  EXPECT_EQ(inspect(together(ball, thorn)).nested_pieces, 0);
}

// Near, but outside: in the notch between two others' boxes, and one touching another.
TEST(Inspect, TakesBodiesBesideEachOther) {
  const TriangleMesh ball = icosphere(0.1, 3);
  const TriangleMesh crumb = shifted(icosphere(0.005, 1), {0.095, 0.095, 0.095});  // in the ball's box
  EXPECT_EQ(inspect(together(ball, crumb)).nested_pieces, 0);
  EXPECT_EQ(inspect(together(cube(), cube({0.01, 0, 0}))).nested_pieces, 0);
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
  EXPECT_THAT(
      [&] { require_closed_surface(broken, "hands/mine.stl"); },
      ThrowsMessage<InputError>(AllOf(HasSubstr("hands/mine.stl: "), HasSubstr("3 boundary edges (1 hole of 34.14 mm)"),
                                      HasSubstr("misoriented edge"))));
}

TEST(InspectSurface, AGoodFileHasNoFault) {
  const SurfaceReport report = inspect_surface(soup_of(file_of(cube(), 1e-3)), 1e-3);
  EXPECT_EQ(report.points, 36);
  EXPECT_EQ(report.faces, 12);
  EXPECT_EQ(report.repeated_points, 28);
  EXPECT_EQ(report.unreferenced_points, 0);
  EXPECT_EQ(report.collapsed_faces, 0);
  EXPECT_EQ(report.duplicate_faces, 0);
  EXPECT_EQ(report.skin.mesh.vertices, 8);
  EXPECT_EQ(report.skin.flat_faces, 0);
  EXPECT_EQ(report.skin.crossings, 0);
  EXPECT_THAT(report.skin.faults, IsEmpty());
  EXPECT_NEAR(report.skin.mesh.volume, 1e-6, 1e-14);
  // Twelve faces of 50 mm2.
  EXPECT_NEAR(report.skin.mean_edge, std::sqrt(50e-6 * 4 / std::sqrt(3.0)), 1e-14);
}

TEST(InspectSurface, CountsWhatIsWrongWithFaces) {
  FileSurface surface = file_of(cube());
  surface.points.emplace_back(1, 2, 3);
  surface.points.emplace_back(-0.0, 0.0, -0.0);                             // corner 0 again
  surface.points.push_back(0.5 * (surface.points[0] + surface.points[1]));  // on the edge 0-1
  surface.triangles.push_back({9, 0, 2});
  surface.triangles.push_back({5, 5, 5});
  surface.triangles.push_back({surface.triangles[4][2], surface.triangles[4][0], surface.triangles[4][1]});
  surface.triangles.push_back({surface.triangles[5][1], surface.triangles[5][0], surface.triangles[5][2]});
  surface.triangles.push_back({0, 10, 1});
  const SurfaceReport report = inspect_surface(surface, 1.0);
  EXPECT_EQ(report.points, 11);
  EXPECT_EQ(report.faces, 17);
  EXPECT_EQ(report.unreferenced_points, 1);
  EXPECT_EQ(report.repeated_points, 1);
  EXPECT_EQ(report.collapsed_faces, 2);
  EXPECT_EQ(report.duplicate_faces, 2);
  EXPECT_EQ(report.skin.flat_faces, 1);
  EXPECT_EQ(report.skin.mesh.boundary_edges, 2);
  EXPECT_EQ(report.skin.mesh.nonmanifold_edges, 1);
  EXPECT_THAT(report.skin.faults,
              ElementsAre(HasSubstr("2 faces have two corners in one point"),
                          HasSubstr("2 faces have the corners of an earlier one"), HasSubstr("1 face without area"),
                          HasSubstr("2 boundary edges"), HasSubstr("1 non-manifold edge")));
}

TEST(InspectSurface, FindsFacesThatCutEachOther) {
  const SurfaceReport report = inspect_surface(together(file_of(cube()), file_of(cube({0.005, 0.004, 0.003}))), 1.0);
  EXPECT_GT(report.skin.crossings, 6);
  ASSERT_EQ(report.skin.faults.size(), 1u);
  EXPECT_THAT(report.skin.faults[0], AllOf(HasSubstr("pairs of faces intersect"), HasSubstr("mm")));
}

TEST(InspectSurface, AMoebiusStripRunsBothWays) {
  const SurfaceReport report = inspect_surface(band(24, true), 1.0);
  EXPECT_EQ(report.skin.mesh.misoriented_edges, 1);  // where the ends meet
  EXPECT_EQ(report.skin.mesh.boundary_edges, 48);
  EXPECT_EQ(report.skin.mesh.holes.size(), 1u);  // its rim is one
  EXPECT_EQ(inspect_surface(band(24, false), 1.0).skin.mesh.holes.size(), 2u);
}

TEST(InspectSurface, NothingThereIsAFault) {
  FileSurface surface;
  EXPECT_THAT(inspect_surface(surface, 1.0).skin.faults, ElementsAre("no face has an area"));
  surface.points.assign(3, Vector3(1, 1, 1));
  surface.triangles = {{0, 1, 2}};
  EXPECT_THAT(inspect_surface(surface, 1.0).skin.faults,
              ElementsAre("1 face has two corners in one point", "no face has an area"));
  surface.points = {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(3, 0, 0)};
  EXPECT_THAT(inspect_surface(surface, 1.0).skin.faults, ElementsAre("no face has an area"));
}

}  // namespace touchfield::inspect_test
