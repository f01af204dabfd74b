#include "sim/cameras/simulated_camera.h"

#include <Eigen/Geometry>

#include "sim/core/units.h"
#include "tests/support/testing.h"

namespace touchfield::simulated_camera_test {

CameraSpec camera_at(const Vector3& at, const Vector3& look_at) {
  CameraSpec spec;
  spec.at = at;
  spec.look_at = look_at;
  return spec;
}

/// Pixels of a point.
Eigen::Vector2d seen_at(const Camera& camera, const Vector3& point) {
  const SeenPoint seen = seen_points(camera, point).col(0);
  return seen.head<2>() / seen(2);
}

TEST(SimulatedCamera, HasTheFieldOfViewOfItsModel) {
  CameraSpec spec = camera_at(Vector3::Zero(), {0, 0, 1});
  const auto view = [&](int width, int height) {
    spec.resolution = {width, height};
    const Camera camera = stereo_camera(spec).view;
    EXPECT_EQ(camera.focal.x(), camera.focal.y());
    EXPECT_EQ(camera.centre, Eigen::Vector2d(0.5 * width, 0.5 * height));
    return Eigen::Vector2d(2 * std::atan(0.5 * width / camera.focal.x()),
                           2 * std::atan(0.5 * height / camera.focal.y()));
  };
  EXPECT_NEAR(view(640, 360).x(), 65 * kDegree, 1e-12);
  EXPECT_NEAR(view(640, 360).y(), 40 * kDegree, 1 * kDegree);
  EXPECT_NEAR(view(1280, 720).x(), 65 * kDegree, 1e-12);
  EXPECT_NEAR(view(640, 480).y(), view(640, 360).y(), 1e-12);
  EXPECT_NEAR(view(640, 240).x(), 65 * kDegree, 1e-12);
  spec.model = "d435";
  EXPECT_NEAR(view(640, 360).x(), 87 * kDegree, 1e-12);
  EXPECT_NEAR(view(640, 360).y(), 58 * kDegree, 2 * kDegree);
  EXPECT_NEAR(view(640, 480).x(), 75 * kDegree, 5 * kDegree);
}

TEST(SimulatedCamera, LooksWhereItIsTold) {
  const CameraSpec spec = camera_at({0.2, -0.1, 0}, {0, 0.05, 0.3});
  const Camera view = stereo_camera(spec).view;
  EXPECT_NO_THROW(require_camera(view));
  EXPECT_LT((seen_at(view, spec.look_at) - view.centre).norm(), 1e-9);
  EXPECT_NEAR(view.axes(2, 0), 0, 1e-15);  // its right is level
  EXPECT_LT(view.axes(2, 1), 0);           // and its image upright
}

TEST(SimulatedCamera, RollsClockwiseAsSeenFromBehind) {
  CameraSpec spec = camera_at(Vector3::Zero(), {0, 1, 0});
  spec.roll = 90 * kDegree;
  const Camera view = stereo_camera(spec).view;
  EXPECT_LT((view.axes.col(0) - Vector3(0, 0, -1)).norm(), 1e-12);  // what was its right is below now
}

TEST(SimulatedCameras, AreToldWithTheErrorOfTheirPlaces) {
  CameraSpec spec = camera_at({0.2, 0, 0}, {0, 0, 0.3});
  spec.shift_error = 3e-3;
  spec.turn_error = 2 * kDegree;
  const SimulatedCameras cameras({spec, spec, camera_at({0.2, 0, 0}, {0, 0, 0.3})}, 7);
  const auto shift = [&](std::size_t c) -> Vector3 { return cameras.told()[c].view.eye - cameras.real()[c].view.eye; };
  for (const std::size_t c : {0, 1}) {
    EXPECT_NEAR(shift(c).norm(), 3e-3, 1e-12);
    EXPECT_NEAR(Eigen::AngleAxisd(cameras.told()[c].view.axes * cameras.real()[c].view.axes.transpose()).angle(),
                2 * kDegree, 1e-9);
    EXPECT_NO_THROW(require_camera(cameras.told()[c].view));
  }
  EXPECT_GT((shift(0) - shift(1)).norm(), 1e-4);
  EXPECT_EQ(shift(2).norm(), 0);
  EXPECT_EQ(cameras.told()[2].view.axes, cameras.real()[2].view.axes);
  EXPECT_EQ(cameras.told()[1].name, "camera_2");
  EXPECT_EQ(SimulatedCameras({spec}, 7).told()[0].view.eye, cameras.told()[0].view.eye);
  EXPECT_NE(SimulatedCameras({spec}, 8).told()[0].view.eye, cameras.told()[0].view.eye);
}

}  // namespace touchfield::simulated_camera_test
