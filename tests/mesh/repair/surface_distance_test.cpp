#include "sim/mesh/repair/surface_distance.h"

#include <cmath>

#include <gtest/gtest.h>

#include "sim/body/shapes.h"
#include "tests/support/mesh_support.h"

namespace touchfield::surface_distance_test {

bool always(const Vector3& /*x*/, const Vector3& /*normal*/) { return true; }

TEST(SurfaceDistance, OfConcentricBoxesIsTheGap) {
  const TriangleMesh inner = box({20e-3, 20e-3, 20e-3}, 20e-3).mesh;
  const TriangleMesh outer = box({22e-3, 22e-3, 22e-3}, 22e-3).mesh;
  const SurfaceDistance out = surface_distance(inner, FaceTree(outer), 1e-3, always);
  EXPECT_NEAR(out.counted, 1.0, 1e-12);
  EXPECT_NEAR(out.most_of_it, 1e-3, 1e-12);
  EXPECT_NEAR(out.farthest, 1e-3, 1e-12);
  // Back it is more along the edges: at most to the corner, and points are asked up to a third of a spacing from it.
  const SurfaceDistance back = surface_distance(outer, FaceTree(inner), 0.25e-3, always);
  EXPECT_GT(back.farthest, 1.6e-3);
  EXPECT_LT(back.farthest, std::sqrt(3.0) * 1e-3);
  EXPECT_GT(back.at.cwiseAbs().minCoeff(), 10.5e-3);
}

// 95 % of the area, not of the faces or the points.
TEST(SurfaceDistance, WeighsByArea) {
  const TriangleMesh plane = box({100e-3, 100e-3, 1e-3}, 100e-3).mesh;
  const auto up = [](const Vector3& /*x*/, const Vector3& normal) { return normal.z() > 0.5; };
  const TriangleMesh far = shifted(plane, {0, 0, 5e-3});
  const TriangleMesh near = box({50e-3, 50e-3, 1e-3}, 1e-3).mesh;  // many small faces, a fifth of the area
  const SurfaceDistance distance = surface_distance(together(far, near), FaceTree(plane), 1.0, up);
  EXPECT_NEAR(distance.most_of_it, 5e-3, 1e-12);
  EXPECT_NEAR(distance.counted, 12500.0 / (2 * 10000 + 400 + 2 * 2500 + 200), 1e-9);
}

TEST(SurfaceDistance, OfNothingCountedIsNothing) {
  const TriangleMesh ball = icosphere(10e-3, 3);
  const SurfaceDistance distance =
      surface_distance(ball, FaceTree(ball), 1e-3, [](const Vector3&, const Vector3&) { return false; });
  EXPECT_EQ(distance.counted, 0.0);
  EXPECT_EQ(distance.farthest, 0.0);
}

}  // namespace touchfield::surface_distance_test
