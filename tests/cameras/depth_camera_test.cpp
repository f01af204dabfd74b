#include "sim/cameras/depth_camera.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace touchfield::depth_camera_test {

DepthCamera camera_with(const std::array<double, 5>& distortion) {
  DepthCamera camera;
  camera.name = "one";
  camera.distortion = distortion;
  camera.view = {.width = 64, .height = 36, .eye = {0.1, -0.2, 0.05}, .near = 0.01};
  camera.view.axes = Eigen::AngleAxisd(0.4, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  camera.view.focal.setConstant(50);
  camera.view.centre << 32, 18;
  return camera;
}

Vector3 world(const DepthCamera& camera, const Eigen::Vector2d& ray, double depth) {
  return camera.view.eye + depth * (camera.view.axes * ray.homogeneous());
}

TEST(ImagePoint, OfAPixelsRayIsItsMiddle) {
  for (const DepthCamera& camera : {camera_with({}), camera_with({-0.2, 0.03, 1e-3, -2e-3, 0.01})}) {
    const Eigen::Matrix2Xd rays = pixel_rays(camera);
    for (int j = 0; j < camera.view.height; ++j) {
      for (int i = 0; i < camera.view.width; ++i) {
        const Eigen::Vector2d ray = rays.col(j * camera.view.width + i);
        const auto point = image_point(camera, world(camera, ray, 0.3));
        ASSERT_TRUE(point);
        EXPECT_LT((point->at - Eigen::Vector2d(i + 0.5, j + 0.5)).norm(), 1e-6);
        EXPECT_EQ(point->pixel(camera.view.width), static_cast<std::size_t>(j * camera.view.width + i));
        EXPECT_LT((point->ray - ray).norm(), 1e-12);
        EXPECT_NEAR(point->depth, 0.3, 1e-12);
      }
    }
  }
}

TEST(ImagePoint, IsNoneBesideTheImageOrBeforeTheCamera) {
  const DepthCamera camera = camera_with({});
  EXPECT_FALSE(image_point(camera, world(camera, {0.65, 0}, 0.3)));
  EXPECT_FALSE(image_point(camera, world(camera, {0, -0.37}, 0.3)));
  EXPECT_FALSE(image_point(camera, world(camera, {0, 0}, 0.009)));
  EXPECT_FALSE(image_point(camera, world(camera, {0, 0}, -0.3)));
}

// x (1 - 0.2 x^2) grows to x = 1.29 and is 0.25 again at 2.1, far beside an image that ends at 0.64.
TEST(ImagePoint, IsNotFoldedBackByItsLens) {
  const DepthCamera camera = camera_with({-0.2, 0, 0, 0, 0});
  EXPECT_LT(distorted(camera, {2.1, 0}).x(), 0.3);
  EXPECT_FALSE(image_point(camera, world(camera, {2.1, 0}, 0.3)));
}

}  // namespace touchfield::depth_camera_test
