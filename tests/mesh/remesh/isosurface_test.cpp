#include "sim/mesh/remesh/isosurface.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sim/mesh/query/inspect.h"

namespace touchfield::isosurface_test {

constexpr double kRadius = 7.3;

template <class Value, class Make>
TriangleMesh surface(const Make& make) {
  const NodeGrid grid{Vector3(-10, -10, -10), 1.0, {21, 21, 21}};
  std::vector<Value> values;
  for (int k = 0; k < 21; ++k) {
    for (int j = 0; j < 21; ++j) {
      for (int i = 0; i < 21; ++i) {
        values.push_back(make(Vector3(i - 10, j - 10, k - 10).norm() - kRadius));
      }
    }
  }
  Isosurface found = isosurface(grid, values);
  return {std::move(found.points), std::move(found.triangles)};
}

TEST(Isosurface, OfDistancesIsTheSphere) {
  const TriangleMesh mesh = surface<float>([](double distance) { return static_cast<float>(distance); });
  require_closed_surface(mesh, "isosurface");
  EXPECT_NEAR(mesh.signed_volume(), 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius, 3), 0.02 * mesh.signed_volume());
  for (const Vector3 x : mesh.vertices().colwise()) {
    EXPECT_NEAR(x.norm(), kRadius, 0.02);  // linear along an edge: 1 / (8 * 7.3)
  }
}

TEST(Isosurface, OfSidesAloneHasItsVerticesHalfway) {
  const TriangleMesh mesh =
      surface<signed char>([](double distance) { return static_cast<signed char>(distance < 0 ? -1 : 1); });
  require_closed_surface(mesh, "isosurface");
  for (const Vector3 x : mesh.vertices().colwise()) {
    const Vector3 twice = 2.0 * x;
    EXPECT_EQ(twice, Vector3(twice.array().round()));
    EXPECT_EQ((x.array() != x.array().floor()).count(), 1);
  }
}

}  // namespace touchfield::isosurface_test
