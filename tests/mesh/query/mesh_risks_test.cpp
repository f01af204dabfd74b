#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "tests/support/mesh_support.h"

namespace touchfield::mesh_risks_test {

using std::numbers::pi;

TEST(MeshRisks, OfASmoothConvexBodyAreSmall) {
  const TriangleMesh mesh = sphere(0.03, 2e-3).mesh;
  const MeshRisks risks = mesh_risks(mesh);
  EXPECT_TRUE(std::isinf(risks.gap));
  EXPECT_TRUE(std::isinf(risks.thickness));
  EXPECT_TRUE(risks.gap_at.array().isNaN().all());
  EXPECT_TRUE(risks.thickness_at.array().isNaN().all());
  EXPECT_GE(risks.size_jump, 1.0);
  EXPECT_LT(risks.size_jump, 1.2);
  EXPECT_GT(risks.smallest_angle, 50.0 * pi / 180.0);
}

// Faces look at each other where they turn by 120 degrees: sqrt(3) radii apart, which is 5 edges at 0.35 radii.
TEST(MeshRisks, ACoarseSphereIsThin) {
  const MeshRisks risks = mesh_risks(sphere(0.03, 0.015).mesh);
  EXPECT_TRUE(std::isinf(risks.gap));
  EXPECT_NEAR(risks.thickness, std::sqrt(3.0) * 0.03 / 0.015, 1.0);
}

// At the nearest points the centroids of two faces are at most some parts of an edge beside each other and 0.5 mm
// apart; the sagitta adds 1.5^2 / (8 * 20) mm twice.
TEST(MeshRisks, FindTheGapBetweenTwoSpheres) {
  const double radius = 0.02;
  const double edge = 1.5e-3;
  const double gap = 0.5e-3;
  const TriangleMesh ball = sphere(radius, edge).mesh;
  // A mirror image, so that face looks at face.
  Points mirrored = ball.vertices();
  mirrored.row(2) *= -1.0;
  Triangles turned = ball.triangles();
  turned.row(0).swap(turned.row(1));
  const TriangleMesh both = together(ball, shifted(TriangleMesh(mirrored, turned), {0, 0, 2 * radius + gap}));
  const MeshRisks risks = mesh_risks(both);
  EXPECT_NEAR(risks.gap, gap / edge, 0.15 * gap / edge);
  EXPECT_LT((risks.gap_at - Vector3(0, 0, radius + 0.5 * gap)).norm(), 2.0 * edge);
  EXPECT_TRUE(std::isinf(risks.thickness));
}

TEST(MeshRisks, FindTheThicknessOfAPlate) {
  const MeshRisks risks = mesh_risks(box({0.03, 0.03, 2e-3}, 2e-3).mesh);
  EXPECT_NEAR(risks.thickness, 1.0, 0.15);
  EXPECT_NEAR(risks.thickness_at.z(), 0.0, 1e-12);
  EXPECT_TRUE(std::isinf(risks.gap));
}

/// An octahedron of legs 10 mm with one leg of another length.
TriangleMesh octahedron(double top) {
  Points vertices(3, 6);
  vertices << 1, -1, 0, 0, 0, 0,  //
      0, 0, 1, -1, 0, 0,          //
      0, 0, 0, 0, top, -1;
  Triangles triangles(3, 8);
  triangles << 0, 2, 1, 3, 2, 1, 3, 0,  //
      2, 1, 3, 0, 0, 2, 1, 3,           //
      4, 4, 4, 4, 5, 5, 5, 5;
  return {0.01 * vertices, triangles};
}

// A face has area 1/2 sqrt(a^2 b^2 + b^2 c^2 + c^2 a^2) of its legs.
TEST(MeshRisks, FindTheJumpOfSizesAndTheSmallestAngle) {
  const double top = 4.0;
  const MeshRisks risks = mesh_risks(octahedron(top));
  EXPECT_NEAR(risks.size_jump, std::pow((1 + 2 * top * top) / 3.0, 0.25), 1e-12);
  EXPECT_NEAR(risks.jump_at.z(), 0.0, 1e-15);
  EXPECT_NEAR(risks.jump_at.norm(), 0.01 * std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(risks.size_range, std::sqrt((1 + top * top) / 2.0), 1e-12);
  EXPECT_NEAR(risks.smallest_angle, 2.0 * std::asin(std::sqrt(0.5) / std::sqrt(1 + top * top)), 1e-12);
  EXPECT_LT((risks.angle_at - Vector3(0, 0, 0.01 * top)).norm(), 1e-15);

  const MeshRisks regular = mesh_risks(octahedron(1.0));
  EXPECT_NEAR(regular.size_jump, 1.0, 1e-12);
  EXPECT_NEAR(regular.size_range, 1.0, 1e-12);
  EXPECT_NEAR(regular.smallest_angle, pi / 3.0, 1e-12);
}

// What is counted over the larger edge does not depend on which of the faces is asked.
TEST(MeshRisks, CountTheGapByTheLargerEdge) {
  const double gap = 1e-3;
  const TriangleMesh coarse = box({0.02, 0.02, 0.02}, 4e-3).mesh;
  const TriangleMesh fine = shifted(box({0.02, 0.02, 0.02}, 1e-3).mesh, {0, 0, 0.02 + gap});
  const double edge = coarse.mean_edge();
  const MeshRisks risks = mesh_risks(together(coarse, fine));
  EXPECT_GE(risks.gap, gap / edge);
  EXPECT_LT(risks.gap, 1.3 * gap / edge);
  EXPECT_NEAR(mesh_risks(together(fine, coarse)).gap, risks.gap, 1e-12);
  EXPECT_NEAR(risks.gap_at.z(), 0.01 + 0.5 * gap, 1e-12);
}

TEST(MeshRisks, FollowTheMeshAndItsUnits) {
  const TriangleMesh mesh = hand({.pose = "index_up", .edge = 6e-3}).mesh;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.8, Vector3(1, 2, -1).normalized()).toRotationMatrix();
  const Vector3 shift(0.1, 0.2, -0.3);
  const MeshRisks before = mesh_risks(mesh);
  const MeshRisks after = mesh_risks(transformed(TriangleMesh(2.0 * mesh.vertices(), mesh.triangles()), turn, shift));
  EXPECT_NEAR(after.size_jump, before.size_jump, 1e-9);
  EXPECT_NEAR(after.size_range, before.size_range, 1e-9);
  EXPECT_NEAR(after.smallest_angle, before.smallest_angle, 1e-9);
  EXPECT_NEAR(after.gap, before.gap, 1e-9);
  EXPECT_NEAR(after.thickness, before.thickness, 1e-9);
  EXPECT_LT((after.gap_at - (turn * 2.0 * before.gap_at + shift)).norm(), 1e-9);
}

TEST(MeshRisks, TakeOneTriangle) {
  Points vertices(3, 3);
  vertices << 0, 3, 0,  //
      0, 0, 4,          //
      0, 0, 0;
  const MeshRisks risks = mesh_risks(TriangleMesh(vertices, Eigen::Vector3i(0, 1, 2)));
  EXPECT_EQ(risks.size_jump, 1.0);
  EXPECT_NEAR(risks.size_range, 5.0 / 3.0, 1e-15);
  EXPECT_NEAR(risks.smallest_angle, std::atan2(3.0, 4.0), 1e-15);
  EXPECT_TRUE(std::isinf(risks.gap) && std::isinf(risks.thickness));
}

}  // namespace touchfield::mesh_risks_test
