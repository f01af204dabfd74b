#include "sim/cameras/vertex_grid.h"

#include <limits>

#include <gtest/gtest.h>

namespace touchfield {
namespace {

TEST(VertexGrid, FindsWhatASearchOfAllFinds) {
  const double reach = 0.15;
  const Points vertices = Points::Random(3, 400);
  Points normals = Points::Random(3, 400);
  normals.colwise().normalize();
  VertexGrid grid;
  grid.build(vertices, normals, reach);
  int none = 0;
  const Points asked = 1.3 * Points::Random(3, 2000);
  for (const Vector3& at : asked.colwise()) {
    const Vector3 normal = Vector3::Random().normalized();
    const Eigen::ArrayXd squared = (vertices.colwise() - at).colwise().squaredNorm();
    Eigen::Index best = 0;
    (squared < reach * reach)
        .select(squared + 2 * 1e-4 * (1 - (normals.transpose() * normal).array()), 1.0)
        .minCoeff(&best);
    if (squared.minCoeff() < reach * reach) {
      EXPECT_DOUBLE_EQ(grid.squared_distance(at), squared.minCoeff());
      EXPECT_EQ(grid.nearest(at, normal), best);
    } else {
      ++none;
      EXPECT_EQ(grid.squared_distance(at), std::numeric_limits<double>::infinity());
      EXPECT_EQ(grid.nearest(at, normal), -1);
    }
  }
  EXPECT_GT(none, 200);
  EXPECT_LT(none, 1800);
}

}  // namespace
}  // namespace touchfield
