#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/topology.h"
#include "tests/support/testing.h"

namespace touchfield::subdivide_test {

constexpr double kRounding = 1e-15;  // [m] of bodies below a metre

TriangleMesh one_triangle() {
  Points vertices(3, 3);
  vertices << 0, 4, 0,  //
      0, 0, 2,          //
      0, 0, 0;
  return {vertices, Eigen::Vector3i(0, 1, 2)};
}

// Euler: a closed surface of genus 0 with F faces has 3 F / 2 edges and F / 2 + 2 vertices.
TEST(EdgeTable, NamesEachEdgeOnceInOrder) {
  const TriangleMesh mesh = icosphere(0.05, 3);
  const EdgeTable edges = edge_table(mesh.triangles());
  EXPECT_EQ(edges.ends.cols(), 3 * mesh.face_count() / 2);
  for (Eigen::Index e = 0; e < edges.ends.cols(); ++e) {
    EXPECT_LT(edges.ends(0, e), edges.ends(1, e));
    EXPECT_EQ((edges.of_face.array() == static_cast<int>(e)).count(), 2);
  }
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector2i side(mesh.triangles()(c, f), mesh.triangles()((c + 1) % 3, f));
      const Eigen::Vector2i ends = edges.ends.col(edges.of_face(c, f));
      EXPECT_TRUE(ends == side || ends == side.reverse());
    }
  }
}

TEST(SplitFaces, NumbersTheChildrenByCornerThenMiddle) {
  const TriangleMesh split = split_faces(one_triangle());
  ASSERT_EQ(split.face_count(), 4);
  ASSERT_EQ(split.vertex_count(), 6);
  for (Eigen::Index child = 0; child < 3; ++child) {
    const Vector3 corner = one_triangle().corner(0, static_cast<int>(child));
    EXPECT_TRUE((split.triangles().col(child).array() == static_cast<int>(child)).any());
    EXPECT_LT((split.centroids().col(child) - 0.5 * (corner + one_triangle().centroids().col(0))).norm(), kRounding);
  }
  EXPECT_TRUE(split.areas().isApproxToConstant(1.0));
}

TEST(SplitFaces, KeepsTheSurfaceAndStaysClosed) {
  for (const TriangleMesh& mesh : {box({0.02, 0.03, 0.01}, 5e-3).mesh, icosphere(0.03, 4), hand({.edge = 8e-3}).mesh}) {
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

TEST(SplitFaces, TwiceSplitsInSixteen) {
  const TriangleMesh twice = split_faces(split_faces(one_triangle()));
  EXPECT_EQ(twice.face_count(), 16);
  EXPECT_EQ(twice.vertex_count(), 15);  // 5 + 4 + 3 + 2 + 1: five on each side
  EXPECT_TRUE(twice.areas().isApproxToConstant(0.25));
}

}  // namespace touchfield::subdivide_test
