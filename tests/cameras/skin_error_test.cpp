#include "tests/support/skin_error.h"

#include <numbers>

#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/sight_support.h"
#include "tests/support/testing.h"

namespace touchfield::skin_distance_test {

constexpr double kRadius = 30e-3;

const TriangleMesh& ball() {
  static const TriangleMesh kBall = icosphere(kRadius, 25);
  return kBall;
}

/// Of the sphere that is `off` mm along z a point at angle t from it is off cos t farther out: mean 0, rms off / sqrt
/// 3, and |cos t| of 95 % of the area is below 0.95.
TEST(SkinDistance, OfASphereThatIsOff) {
  const TriangleMesh off = shifted(ball(), Vector3(0, 0, 1e-3));
  const SkinDistance all = skin_distance(ball(), signed_distances(ball(), off), {});
  EXPECT_NEAR(all.area, 4 * std::numbers::pi * kRadius * kRadius, 1e-2 * all.area);
  EXPECT_NEAR(all.mean, 0, 0.03e-3);
  EXPECT_NEAR(all.rms, 1e-3 / std::sqrt(3.0), 0.01e-3);
  EXPECT_NEAR(all.p95, 0.95e-3, 0.01e-3);
  EXPECT_NEAR(all.most, 1e-3, 0.01e-3);
}

/// The far side of a thin plate is nearer to what was moved through it than the side itself.
TEST(SkinDistance, DoesNotTakeTheBackForTheFront) {
  const TriangleMesh plate = box({0.04, 0.04, 2e-3}, 2e-3).mesh;
  const TriangleMesh off = shifted(plate, Vector3(0, 0, 1.5e-3));
  std::vector<bool> top;
  for (Eigen::Index f = 0; f < plate.face_count(); ++f) {
    top.push_back(plate.normals()(2, f) > 0.5 && plate.centroids().col(f).head<2>().cwiseAbs().maxCoeff() < 0.015);
  }
  const SkinDistance distance = skin_distance(plate, signed_distances(plate, off), top);
  EXPECT_NEAR(distance.mean, 1.5e-3, 1e-12);
  EXPECT_NEAR(distance.rms, 1.5e-3, 1e-12);
}

}  // namespace touchfield::skin_distance_test
