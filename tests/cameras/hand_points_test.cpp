#include "sim/cameras/seen_skin.h"
#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/sight_support.h"
#include "tests/support/testing.h"

namespace touchfield::hand_points_test {

const Vector3 kMiddle(0, 0, 0.25);

Box box_round(const Vector3& middle, double half) {
  return {middle - Vector3::Constant(half), middle + Vector3::Constant(half)};
}

double rms(const Eigen::ArrayXd& values) { return std::sqrt(values.square().mean()); }

TEST(HandPoints, OfAPlaneAreExact) {
  const std::vector<DepthCamera> cameras = cameras_round(kMiddle, 0.25, 0.25, 3);
  const TriangleMesh plate = transformed(box({0.2, 0.2, 0.02}, 0.05).mesh, Eigen::Matrix3d::Identity(), kMiddle);
  const DepthFrame frame = exact_frame(cameras, plate);
  // Only the side below: z = 0.24.
  const HandPoints points = PointReader(cameras).read(frame, box_round(kMiddle - Vector3(0, 0, 0.01), 0.09));
  EXPECT_GT(points.size(), 3000);
  EXPECT_LE(points.size(), 6000);
  EXPECT_LT((points.at.row(2).array() - 0.24).abs().maxCoeff(), 2e-7);
  EXPECT_LT((points.normal.colwise() + Vector3::UnitZ()).norm() / std::sqrt(points.size()), 1e-4);
  EXPECT_TRUE(std::ranges::is_sorted(points.camera));
}

TEST(HandPoints, OfASphereLieOnIt) {
  const std::vector<DepthCamera> cameras = cameras_round(kMiddle, 0.25, 0.25, 3);
  constexpr double kRadius = 8e-3;  // a finger's
  const TriangleMesh ball = shifted(icosphere(kRadius, 60), kMiddle);
  const HandPoints points = PointReader(cameras).read(exact_frame(cameras, ball), box_round(kMiddle, 0.05));
  ASSERT_GT(points.size(), 400);
  const Points out = (points.at.colwise() - kMiddle).colwise().normalized();
  const Eigen::ArrayXd off = (points.at.colwise() - kMiddle).colwise().norm().array() - kRadius;
  EXPECT_LT(rms(off), 0.01e-3);
  EXPECT_LT(std::abs(off.mean()), 0.01e-3);
  const Eigen::ArrayXd cosines = (out.array() * points.normal.array()).colwise().sum();
  EXPECT_LT(rms(cosines.min(1).acos()), 5 * kDegree);
  EXPECT_GT(cosines.minCoeff(), std::cos(20 * kDegree));
}

TEST(HandPoints, NoiseIsWhatSigmaSaysAndTurnsNormalsLittle) {
  const std::vector<DepthCamera> cameras{depth_camera(Vector3::Zero(), kMiddle, Vector3::UnitY())};
  const TriangleMesh plate = shifted(box({0.5, 0.3, 0.1}, 0.1).mesh, Vector3(0, 0, 0.4));
  DepthFrame frame = exact_frame(cameras, plate);
  add_stereo_noise(frame, cameras, 1);
  const HandPoints points = PointReader(cameras).read(frame, box_round(Vector3(0, 0, 0.35), 0.1));
  ASSERT_GT(points.size(), 1500);
  const double noise = rms(points.at.row(2).transpose().array() - 0.35);
  EXPECT_NEAR(points.sigma.mean(), std::hypot(0.35 * 0.35 * 0.08 / (502.3 * 0.055), 1e-3 / std::sqrt(12)), 2e-6);
  EXPECT_LT(noise, points.sigma.mean());
  EXPECT_GT(noise, 0.5 * points.sigma.mean());
  EXPECT_LT(rms((-points.normal.row(2)).transpose().array().min(1).acos()), 7 * kDegree);
}

TEST(HandPoints, DropEdgesAndWhatFlies) {
  const std::vector<DepthCamera> cameras{depth_camera(Vector3::Zero(), kMiddle, Vector3::UnitY())};
  const TriangleMesh near = shifted(box({0.04, 0.04, 0.01}, 0.02).mesh, Vector3(0, 0, 0.305));
  const TriangleMesh far = shifted(box({0.4, 0.4, 0.01}, 0.1).mesh, Vector3(0, 0, 0.405));
  DepthFrame frame = exact_frame(cameras, together(near, far));
  DepthImage& image = frame.images[0];
  const std::vector<float> exact = image.depth;
  for (int row = 1; row < image.height - 1; ++row) {
    for (int column = 1; column < image.width - 1; ++column) {
      const auto at = static_cast<std::size_t>(row * image.width + column);
      if (std::abs(exact[at] - exact[at - 1]) > 0.01F || std::abs(exact[at] - exact[at - 640]) > 0.01F) {
        image.depth[at] = 0.35F;
      }
    }
  }
  image.depth[100] = -1.0F;
  image.depth[200] = std::numeric_limits<float>::quiet_NaN();
  const PointReader reader(cameras, {.most = 100000});
  const HandPoints points = reader.read(frame, box_round(Vector3(0, 0, 0.35), 0.12));
  ASSERT_GT(points.size(), 10000);
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    const double z = points.at(2, i);
    EXPECT_TRUE(std::abs(z - 0.3) < 1e-6 || std::abs(z - 0.4) < 1e-6) << z;
    EXPECT_GT(-points.normal(2, i), 0.9999);
  }
}

}  // namespace touchfield::hand_points_test
