#include "sim/mesh/triangle_mesh.h"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "tests/support/testing.h"

namespace touchfield::triangle_mesh_test {

constexpr double kRounding = 1e-14;  // relative, some tens of operations in double precision

/// The corner of a cube cut off: legs of length 1 along the axes, counter-clockwise seen from outside.
Points tetrahedron_vertices() {
  Points vertices(3, 4);
  vertices << 0, 1, 0, 0,  //
      0, 0, 1, 0,          //
      0, 0, 0, 1;
  return vertices;
}

Triangles tetrahedron_triangles() {
  Triangles triangles(3, 4);
  triangles << 0, 0, 0, 1,  //
      2, 1, 3, 2,           //
      1, 3, 2, 3;
  return triangles;
}

TEST(TriangleMesh, GivesCentroidsNormalsAndAreas) {
  const TriangleMesh mesh(tetrahedron_vertices(), tetrahedron_triangles());
  EXPECT_TRUE(mesh.centroids().col(0).isApprox(Vector3(1, 1, 0) / 3.0, kRounding));
  EXPECT_TRUE(mesh.normals().col(0).isApprox(Vector3(0, 0, -1), kRounding));
  EXPECT_TRUE(mesh.normals().col(3).isApprox(Vector3(1, 1, 1) / std::sqrt(3.0), kRounding));
  EXPECT_NEAR(mesh.areas()(0), 0.5, kRounding);
  EXPECT_NEAR(mesh.areas()(3), std::sqrt(3.0) / 2.0, kRounding);  // equilateral with sides sqrt(2)
  EXPECT_NEAR(mesh.total_area(), 1.5 + std::sqrt(3.0) / 2.0, kRounding);
  EXPECT_NEAR(mesh.signed_volume(), 1.0 / 6.0, kRounding);
}

// 1 km away a volume about the origin would lose nine digits of the ratio (distance / size)^3.
TEST(TriangleMesh, VolumeSurvivesAMoveFarAway) {
  const TriangleMesh mesh(tetrahedron_vertices(), tetrahedron_triangles());
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(1.1, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  const TriangleMesh moved = transformed(mesh, rotation, {1000, -2000, 500});
  EXPECT_NEAR(moved.signed_volume(), 1.0 / 6.0, 1e-11);  // vertices keep 2e-13 of their metre
  EXPECT_NEAR(moved.total_area(), mesh.total_area(), 1e-11);
  EXPECT_TRUE(moved.normals().isApprox(rotation * mesh.normals(), 1e-11));
  EXPECT_TRUE(moved.centroids().isApprox((rotation * mesh.centroids()).colwise() + Vector3(1000, -2000, 500), 1e-14));
}

TEST(TriangleMesh, RefusesWhatIsNoMesh) {
  EXPECT_THAT([] { TriangleMesh(tetrahedron_vertices(), Triangles(3, 0)); },
              ThrowsMessage<InputError>(HasSubstr("no triangle")));

  Triangles beyond = tetrahedron_triangles();
  beyond(1, 2) = 4;
  EXPECT_THAT([&] { TriangleMesh(tetrahedron_vertices(), beyond); },
              ThrowsMessage<InputError>(HasSubstr("face 2 names a vertex outside 0..3")));

  Points broken = tetrahedron_vertices();
  broken(2, 1) = std::numeric_limits<double>::quiet_NaN();
  broken(0, 3) = std::numeric_limits<double>::infinity();
  EXPECT_THAT([&] { TriangleMesh(broken, tetrahedron_triangles()); },
              ThrowsMessage<InputError>(HasSubstr("2 of 4 vertices")));

  Triangles folded = tetrahedron_triangles();
  folded.col(1) << 0, 1, 1;
  EXPECT_THAT([&] { TriangleMesh(tetrahedron_vertices(), folded); },
              ThrowsMessage<InputError>(HasSubstr("1 degenerate faces (no area), the first is face 1")));
}

}  // namespace touchfield::triangle_mesh_test
