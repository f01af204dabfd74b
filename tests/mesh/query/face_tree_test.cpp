#include "sim/mesh/query/face_tree.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "sim/hand/body.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"

namespace touchfield::face_tree_test {

constexpr double kWinding = 0.06;  // accuracy of winding numbers, as the header says

/// Points of a box half as large again as the mesh's.
Points points_around(const TriangleMesh& mesh, Eigen::Index count) {
  const Vector3 lower = mesh.vertices().rowwise().minCoeff();
  const Vector3 size = mesh.vertices().rowwise().maxCoeff() - lower;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-0.25, 1.25);
  Points points(3, count);
  for (auto x : points.colwise()) {
    x = lower + size.cwiseProduct(Vector3(uniform(random), uniform(random), uniform(random)));
  }
  return points;
}

// The search for landmarks goes through all faces with another formula.
TEST(FaceTree, FindsTheNearestPointOfAll) {
  const TriangleMesh mesh = hand({.edge = 6e-3}).mesh;
  const FaceTree tree(mesh);
  const Points points = points_around(mesh, 300);
  for (const Vector3 x : points.colwise()) {
    const SkinPoint found = tree.nearest(x);
    const Vector3 expected = position(mesh, nearest_landmark(mesh, "x", x));
    EXPECT_NEAR(found.distance, (expected - x).norm(), 1e-12);
    EXPECT_NEAR((found.at - x).norm(), found.distance, 1e-15);
    // `at` lies on the face it names.
    const TriangleMesh alone(mesh.vertices(), mesh.triangles().col(found.face));
    EXPECT_LT((position(alone, nearest_landmark(alone, "x", found.at)) - found.at).norm(), 1e-12);
  }
}

TEST(FaceTree, FindsNothingBeyondTheLimit) {
  const TriangleMesh mesh = box({0.02, 0.02, 0.02}, 5e-3).mesh;
  const FaceTree tree(mesh);
  const Vector3 x(0.001, 0.002, 0.013);  // 3 mm above the top
  EXPECT_NEAR(tree.nearest(x, 3.01e-3).distance, 3e-3, 1e-15);
  EXPECT_EQ(tree.nearest(x, 2.99e-3).face, -1);
}

TEST(FaceTree, FindsTheNearestFaceThatLooksThatWay) {
  const TriangleMesh mesh = box({0.02, 0.02, 1e-3}, 2e-3).mesh;
  const FaceTree tree(mesh);
  const Vector3 x(0.001, 0.002, 0.45e-3);  // just under the top
  EXPECT_NEAR(tree.nearest_facing(x, Vector3::UnitZ(), 0.5).distance, 0.05e-3, 1e-15);
  EXPECT_NEAR(tree.nearest_facing(x, -Vector3::UnitZ(), 0.5).distance, 0.95e-3, 1e-15);
  EXPECT_NEAR(tree.nearest_facing(x, Vector3::UnitX(), 0.5).distance, 9e-3, 1e-15);
  EXPECT_EQ(tree.nearest_facing(x, Vector3(1, 1, 1).normalized(), 0.9).face, -1);
}

/// By the solid angle of every face (Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125).
double winding_of_all_faces(const TriangleMesh& mesh, const Vector3& x) {
  double angle = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 a = mesh.corner(f, 0) - x;
    const Vector3 b = mesh.corner(f, 1) - x;
    const Vector3 c = mesh.corner(f, 2) - x;
    angle += 2.0 * std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                     b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return angle / (4.0 * std::numbers::pi);
}

TEST(FaceTree, WindsAsAllFacesDoRoundAHandWithHolesAndTurnedFaces) {
  const TriangleMesh whole = hand({.edge = 4e-3}).mesh;
  std::mt19937 random(3);
  Triangles triangles(3, whole.face_count());
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < whole.face_count(); ++f) {
    const bool hole = whole.centroids()(1, f) < 0.01 || random() % 10 == 0;
    if (!hole) {
      triangles.col(count) = whole.triangles().col(f);
      if (random() % 10 == 0) {
        std::swap(triangles(0, count), triangles(1, count));
      }
      ++count;
    }
  }
  const TriangleMesh soup(whole.vertices(), triangles.leftCols(count));
  const FaceTree tree(soup);
  const Points points = points_around(soup, 1000);
  double squares = 0;
  for (const Vector3 x : points.colwise()) {
    const double exact = winding_of_all_faces(soup, x);
    EXPECT_NEAR(tree.winding_number(x), exact, kWinding);
    squares += std::pow(tree.winding_number(x) - exact, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(points.cols())), 0.006);
}

}  // namespace touchfield::face_tree_test
