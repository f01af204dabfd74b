#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/resurface.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"

namespace touchfield::inside_grid_test {

TriangleMesh surface_of(const InsideGrid& grid) {
  Isosurface surface = grid.surface();
  TriangleMesh mesh(std::move(surface.points), std::move(surface.triangles));
  const MeshReport report = inspect(mesh);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.nonmanifold_vertices, 0);
  EXPECT_EQ(report.misoriented_edges, 0);
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
  return mesh;
}

// Vertices lie on the faces themselves, so that only the chords between them leave the surface.
TEST(InsideGrid, VerticesLieOnTheFaces) {
  const TriangleMesh ball = icosphere(10e-3, 12);
  const TriangleMesh mesh = surface_of(InsideGrid(ball, 1e-3));
  const FaceTree tree(ball);
  Eigen::Index off = 0;
  for (const Vector3 x : mesh.vertices().colwise()) {
    const double distance = tree.nearest(x).distance;
    off += distance > 1e-5 ? 1 : 0;  // a hundredth of the spacing
    EXPECT_LT(distance, 0.16e-3);    // at single nodes on top, not deeper than (1 mm)^2 / (2 * 10 mm)
  }
  EXPECT_LT(off, mesh.vertex_count() / 100);
  EXPECT_NEAR(mesh.signed_volume(), ball.signed_volume(), 0.01 * ball.signed_volume());
}

TEST(InsideGrid, ErrorsFallWithTheSquareOfTheSpacing) {
  const TriangleMesh ball = icosphere(10e-3, 40);
  const auto error = [&](double spacing) {
    return 1.0 - surface_of(InsideGrid(ball, spacing)).signed_volume() / ball.signed_volume();
  };
  EXPECT_NEAR(error(1e-3) / error(0.5e-3), 4.0, 0.8);
}

TEST(InsideGrid, CavitiesHaveWalls) {
  const TriangleMesh inner = icosphere(6e-3, 8);
  Triangles turned = inner.triangles();
  turned.row(0).swap(turned.row(1));
  const TriangleMesh shell = together(icosphere(12e-3, 12), TriangleMesh(inner.vertices(), turned));
  EXPECT_NEAR(surface_of(InsideGrid(shell, 1e-3)).signed_volume(), shell.signed_volume(), 0.01 * shell.signed_volume());
}

// Half a ball's skin: w is 1/2 on the disc through its rim, and nothing but w tells where that is.
TEST(InsideGrid, AHoleIsClosedWhereTheWindingNumberIsAHalf) {
  const TriangleMesh ball = icosphere(10e-3, 16);
  std::vector<int> upper;
  for (Eigen::Index f = 0; f < ball.face_count(); ++f) {
    if (ball.centroids()(2, f) > 0) {
      upper.push_back(static_cast<int>(f));
    }
  }
  const TriangleMesh half(ball.vertices(), ball.triangles()(Eigen::all, upper));
  const TriangleMesh mesh = surface_of(InsideGrid(half, 0.5e-3));
  const FaceTree tree(half);
  for (const Vector3 x : mesh.vertices().colwise()) {
    if (tree.nearest(x).distance > 1e-3) {
      EXPECT_NEAR(tree.winding_number(x), 0.5, 0.02);
    }
  }
  // The dome above its lid, where w = 1/2: lower than the rim's plane by no more than w's fall there.
  EXPECT_GT(mesh.signed_volume(), 0.3 * ball.signed_volume());
  EXPECT_LT(mesh.signed_volume(), 0.55 * ball.signed_volume());
}

TEST(InsideGrid, ThinPartsGoAndNarrowGapsClose) {
  const TriangleMesh plate = box({20e-3, 20e-3, 0.8e-3}, 2e-3).mesh;
  const TriangleMesh block = box({10e-3, 10e-3, 10e-3}, 2e-3).mesh;
  const InsideGrid thin(together(block, shifted(plate, {0, 0, 20e-3})), 1e-3);
  EXPECT_NEAR(surface_of(thin).signed_volume(), 1e-6, 0.05e-6);
  const InsideGrid narrow(together(block, shifted(block, {0, 0, 10.8e-3})), 1e-3);
  EXPECT_EQ(inspect(surface_of(narrow)).components, 1);
}

TEST(InsideGrid, AFlatSheetHasNoInside) {
  Points vertices(3, 3);
  vertices << 0, 10e-3, 0,  //
      0, 0, 10e-3,          //
      0, 0, 0;
  EXPECT_EQ(InsideGrid(TriangleMesh(vertices, Eigen::Vector3i(0, 1, 2)), 1e-3).surface().triangles.cols(), 0);
}

TEST(InsideGrid, CountsItsNodesBeforehand) {
  // 10 spacings a side, two about it on either side, and one for the offset.
  EXPECT_NEAR(node_count(Vector3::Constant(10e-3), 1e-3), 16.0 * 16.0 * 16.0, 1e-9);
}

}  // namespace touchfield::inside_grid_test
