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

TriangleMesh larger(double by) { return {ball().vertices() * (1 + by / kRadius), ball().triangles()}; }

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

TEST(SkinDistance, IsPositiveWhereTheFittedSkinIsOutsideInBothDirections) {
  const std::vector<bool> none(static_cast<std::size_t>(ball().face_count()), false);
  for (const double by : {-1e-3, 2e-3}) {
    const SkinError error = skin_error(ball(), larger(by), none, {Vector3::Zero(), 1.0});
    EXPECT_EQ(error.seen.area, 0);
    EXPECT_EQ(error.seen.rms, 0);
    EXPECT_NEAR(error.all.mean, by, 0.01e-3);
    EXPECT_NEAR(error.back.mean, by, 0.01e-3);
    EXPECT_NEAR(error.patch.mean, error.all.mean, 1e-15);
    EXPECT_NEAR(error.all.p95, std::abs(by), 0.01e-3);
  }
}

/// The cap of 69.46 degrees of a ball that is seen under less than 75 degrees from ten radii away.
constexpr double kShareSeen = 0.3246;

TEST(SkinDistance, EvaluatesWhatIsSeenAndThePatch) {
  const std::vector<DepthCamera> cameras{depth_camera(Vector3(0, 0, -0.3), Vector3::Zero(), Vector3::UnitY())};
  const std::vector<bool> seen = faces_seen(cameras, ball());
  // Too large below the middle only.
  Points vertices = ball().vertices();
  for (auto x : vertices.colwise()) x *= x.z() < 0 ? 1 + 1e-3 / kRadius : 1;
  const SkinError error = skin_error(ball(), {vertices, ball().triangles()}, seen, {Vector3(0, 0, kRadius), 10e-3});
  EXPECT_NEAR(error.seen.area / error.all.area, kShareSeen, 0.005);
  EXPECT_NEAR(error.seen.rms, 1e-3, 0.02e-3);
  EXPECT_NEAR(error.patch.area, std::numbers::pi * 1e-4, 0.05 * error.patch.area);
  EXPECT_LT(error.patch.rms, 1e-6);
  EXPECT_NEAR(error.all.mean, 0.5e-3, 0.02e-3);
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

TEST(SkinDistance, LeavesOutWhatNothingFaces) {
  Triangles one(3, 1);
  one << 0, 1, 2;
  Points corners(3, 3);
  corners << 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0;
  Triangles turned(3, 1);
  turned << 0, 2, 1;
  const Eigen::VectorXd distances = signed_distances({corners, one}, {corners, turned});
  EXPECT_TRUE(std::isnan(distances(0)));
  EXPECT_EQ(skin_distance({corners, one}, distances, {}).area, 0);
  EXPECT_THROW(skin_distance(ball(), distances, {}), InputError);
}

}  // namespace touchfield::skin_distance_test
