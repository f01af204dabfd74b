#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "sim/cameras/simulated_camera.h"
#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/threads_support.h"

namespace touchfield::stereo_noise_test {

/// At the origin, looking along +z, x to the right of its image.
CameraSpec upward(int width = 640, int height = 360) {
  CameraSpec spec;
  spec.look_at = Vector3::UnitZ();
  spec.resolution = {width, height};
  return spec;
}

/// A square plate at a depth [m], across the axis.
TriangleMesh plate(double depth, double half, const Vector3& centre = Vector3::Zero()) {
  Points corners(3, 4);
  corners << -half, half, half, -half, -half, -half, half, half, depth, depth, depth, depth;
  corners.colwise() += centre;
  Triangles faces(3, 2);
  faces << 0, 0, 2, 3, 1, 2;
  return {corners, faces};
}

DepthImage image_of(const StereoCamera& camera, const TriangleMesh& mesh, const StereoEffects& effects,
                    std::uint64_t key = 1) {
  return stereo_image(camera, rasterise(camera.view, mesh.vertices(), mesh.triangles()), mesh.normals(), effects, key);
}

double depth_at(const DepthImage& image, int i, int j) {
  return static_cast<double>(
      image.depth[static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(i)]);
}

/// Mean square of depth - exact over an image, and the mean product of pixels `lag` columns apart.
struct Spread {
  double square = 0;
  double product = 0;
};
Spread spread_of(const DepthImage& image, double exact, int lag) {
  Spread sum;
  int count = 0;
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i + lag < image.width; ++i) {
      const double here = depth_at(image, i, j) - exact;
      sum.square += here * here;
      sum.product += here * (depth_at(image, i + lag, j) - exact);
      ++count;
    }
  }
  return {sum.square / count, sum.product / count};
}

TEST(StereoNoise, OfAFlatTargetIsTheFormulas) {
  const StereoCamera camera = stereo_camera(upward());
  StereoEffects effects = StereoEffects::none();
  effects.noise = true;
  constexpr int kFrames = 4;
  for (const double z : {0.25, 0.3, 0.4, 0.5, 0.6, 0.8}) {
    const TriangleMesh target = plate(z, 2 * z);
    const double rms = z * z * 0.08 / camera.disparity_metres();
    for (const int lag : {1, 3, 5, 8}) {
      Spread sum;
      for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
        const Spread one = spread_of(image_of(camera, target, effects, noise_key(3, 0, frame)), z, lag);
        sum.square += one.square / kFrames;
        sum.product += one.product / kFrames;
      }
      EXPECT_NEAR(std::sqrt(sum.square), rms, 0.05 * rms) << z;
      EXPECT_NEAR(sum.product / sum.square, std::exp(-lag * lag / (4 * kNoiseBlur * kNoiseBlur)), 0.05) << z << lag;
    }
  }
  EXPECT_NEAR(0.09 * 0.08 / camera.disparity_metres(), 0.26e-3, 0.005e-3);
  EXPECT_NEAR(0.36 * 0.08 / camera.disparity_metres(), 1.04e-3, 0.005e-3);
}

TEST(StereoNoise, StepsAddATwelfthOfTheirSquare) {
  const StereoCamera camera = stereo_camera(upward());
  StereoEffects effects = StereoEffects::none();
  effects.disparity_steps = true;
  effects.depth_steps = true;
  for (const double z : {0.3, 0.5, 0.8}) {
    const double slope = z * z / camera.disparity_metres();  // [m] a pixel of disparity
    const double steps = (std::pow(slope * kDisparityStep, 2) + std::pow(camera.depth_unit, 2)) / 12;
    const double noise = std::pow(slope * camera.disparity_noise, 2);
    for (const bool noisy : {false, true}) {
      effects.noise = noisy;
      double square = 0;
      constexpr int kTargets = 40;  // over 4 mm, whole numbers of both steps but for a little
      for (int i = 0; i < kTargets; ++i) {
        const double exact = z + 1e-4 * i;
        square +=
            spread_of(image_of(camera, plate(exact, 2), effects, static_cast<std::uint64_t>(i)), exact, 0).square /
            kTargets;
      }
      const double expected = steps + (noisy ? noise : 0.0);
      EXPECT_NEAR(square, expected, (noisy ? 0.05 : 0.15) * expected) << z;
    }
  }
}

TEST(StereoNoise, SphereBeforeNoiseHasItsDepth) {
  const StereoCamera camera = stereo_camera(upward());
  const double radius = 0.03;
  const Vector3 centre(0.02, -0.01, 0.3);
  const TriangleMesh mesh = transformed(icosphere(radius, 70), Eigen::Matrix3d::Identity(), centre);
  const DepthImage image = image_of(camera, mesh, [] {
    StereoEffects effects = StereoEffects::none();
    effects.grazing = true;
    return effects;
  }());
  int seen = 0;
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      const double depth = depth_at(image, i, j);
      const Vector3 ray((i + 0.5 - 320) / camera.view.focal.x(), (j + 0.5 - 180) / camera.view.focal.y(), 1);
      const double along = ray.dot(centre);
      const double root = along * along - ray.squaredNorm() * (centre.squaredNorm() - radius * radius);
      if (root < 0) {
        EXPECT_EQ(depth, 0);
        continue;
      }
      const double exact = (along - std::sqrt(root)) / ray.squaredNorm();
      const double incidence = std::acos(std::abs((exact * ray - centre).dot(ray)) / (radius * ray.norm()));
      if (depth > 0) {
        ++seen;
        EXPECT_NEAR(depth, exact, 1e-5);
        EXPECT_LT(incidence, kGrazing + 0.02);
      } else {
        EXPECT_GT(incidence, kGrazing - 0.02);
      }
    }
  }
  EXPECT_GT(seen, 5000);
}

TEST(StereoNoise, SecondEyeLeavesHolesOnTheLeft) {
  const StereoCamera camera = stereo_camera(upward());
  const double front = 0.3;
  const double back = 0.4;
  const TriangleMesh mesh = together(plate(front, 0.03), plate(back, 1));
  StereoEffects effects = StereoEffects::none();
  effects.second_eye = true;
  const DepthImage image = image_of(camera, mesh, effects);
  const double hidden = camera.disparity_metres() / front - camera.disparity_metres() / back;
  const double band = camera.disparity_metres() / back;
  int j = 180;
  int holes_beside = 0;
  for (int i = 0; i < image.width; ++i) {
    const bool hole = depth_at(image, i, j) == 0;
    if (i < 100) {
      EXPECT_EQ(hole, i + 0.5 < band) << i;
    } else {
      holes_beside += hole ? 1 : 0;
      EXPECT_TRUE(!hole || (i > 320 - 0.03 * camera.view.focal.x() / front - hidden - 1.5 && i < 320)) << i;
    }
  }
  EXPECT_NEAR(holes_beside, hidden, 1.01);
}

TEST(StereoNoise, AShareOfAnEdgesPixelsFlies) {
  const StereoCamera camera = stereo_camera(upward());
  StereoEffects effects = StereoEffects::none();
  effects.flying = true;
  for (const double back : {0.33, 0.5}) {
    const TriangleMesh mesh = together(plate(0.3, 0.05), plate(back, 1));
    const Raster exact = rasterise(camera.view, mesh.vertices(), mesh.triangles());
    int edge = 0;
    int flying = 0;
    double mean = 0;
    for (std::uint64_t frame = 0; frame < 10; ++frame) {
      const DepthImage image = image_of(camera, mesh, effects, noise_key(1, 0, frame));
      for (int j = 1; j + 1 < image.height; ++j) {
        for (int i = 1; i + 1 < image.width; ++i) {
          const bool front = exact.face[exact.index(i, j)] < 2;
          const bool at_edge =
              front && (exact.face[exact.index(i - 1, j)] > 1 || exact.face[exact.index(i + 1, j)] > 1 ||
                        exact.face[exact.index(i, j - 1)] > 1 || exact.face[exact.index(i, j + 1)] > 1);
          const double depth = depth_at(image, i, j);
          const bool flies = std::abs(depth - (front ? 0.3 : back)) > 1e-6;
          edge += at_edge ? 1 : 0;
          flying += flies ? 1 : 0;
          EXPECT_TRUE(at_edge || !flies);
          if (flies) {
            EXPECT_GT(depth, 0.3);
            EXPECT_LT(depth, std::min(back, 0.35) + 1e-6);
            mean += depth;
          }
        }
      }
    }
    EXPECT_NEAR(flying, kFlyingShare * edge, 4 * std::sqrt(0.16 * edge));
    EXPECT_NEAR(mean / flying, 0.5 * (0.3 + std::min(back, 0.35)), 0.002);
  }
}

TEST(StereoNoise, DependsOnItsKeyAlone) {
  const StereoCamera camera = stereo_camera(upward());
  const TriangleMesh small = transformed(icosphere(0.03, 20), Eigen::Matrix3d::Identity(), Vector3(0.01, 0, 0.3));
  const DepthImage one = with_threads(1, [&] { return image_of(camera, small, {}, noise_key(1, 2, 3)); });
  EXPECT_EQ(with_threads(4, [&] { return image_of(camera, small, {}, noise_key(1, 2, 3)); }).depth, one.depth);
  for (const std::uint64_t key : {noise_key(2, 2, 3), noise_key(1, 3, 3), noise_key(1, 2, 4)}) {
    EXPECT_NE(image_of(camera, small, {}, key).depth, one.depth);
  }
  // The noise is the image's, however much of it sees anything.
  StereoEffects effects = StereoEffects::none();
  effects.noise = true;
  const DepthImage alone = image_of(camera, small, effects);
  const DepthImage before = image_of(camera, together(small, plate(0.5, 1)), effects);
  for (std::size_t p = 0; p < alone.depth.size(); ++p) {
    EXPECT_TRUE(alone.depth[p] == 0 || alone.depth[p] == before.depth[p]) << p;
  }
}

TEST(StereoNoise, SeesFromTheNearestDepthOn) {
  const StereoCamera camera = stereo_camera(upward());
  EXPECT_NEAR(camera.nearest(), 0.22, 0.002);
  StereoEffects effects = StereoEffects::none();
  effects.range = true;
  EXPECT_EQ(depth_at(image_of(camera, plate(camera.nearest() - 1e-4, 1), effects), 400, 100), 0);
  EXPECT_NEAR(depth_at(image_of(camera, plate(camera.nearest() + 1e-4, 1), effects), 400, 100), camera.nearest() + 1e-4,
              1e-7);
  StereoCamera fine = camera;
  fine.depth_unit = 1e-5;
  effects.depth_steps = true;
  EXPECT_EQ(depth_at(image_of(fine, plate(0.66, 1), effects), 400, 100), 0);
  EXPECT_NEAR(depth_at(image_of(fine, plate(0.65, 1), effects), 400, 100), 0.65, 1e-7);
}

}  // namespace touchfield::stereo_noise_test
