#include <gtest/gtest.h>

#include "sim/cameras/seen_skin.h"
#include "sim/cameras/simulated_camera.h"
#include "sim/hand/shapes.h"

namespace touchfield::seen_distance_test {

/// Three cameras round a sphere in the origin.
SimulatedCameras round_the_origin() {
  std::vector<CameraSpec> specs(3);
  specs[0].at = {0.3, 0, -0.1};
  specs[1].at = {-0.25, 0.1, -0.1};
  specs[2].at = {0, -0.3, 0.1};
  return {specs, 1};
}

DepthFrame exact_frame(const SimulatedCameras& cameras, const TriangleMesh& mesh) {
  return cameras.sees(mesh, 0, 0, StereoEffects::none());
}

TEST(SeenDistance, IsThatOfASkinThatWasMoved) {
  const SimulatedCameras cameras = round_the_origin();
  const TriangleMesh sphere = touchfield::sphere(40e-3, 3e-3).mesh;
  const DepthFrame frame = exact_frame(cameras, sphere);
  for (const double grown : {0.0, 1e-3, -2e-3}) {
    const TriangleMesh held(sphere.vertices() * (1 + grown / 40e-3), sphere.triangles());
    const SeenDistance seen = seen_distance(cameras.told(), frame, held);
    int faces = 0;
    double worst = 0;
    for (Eigen::Index f = 0; f < held.face_count(); ++f) {
      EXPECT_EQ(seen.cameras(f) == 0, std::isnan(seen.distance(f)));
      if (seen.cameras(f) > 0) {
        ++faces;
        worst = std::max(worst, std::abs(seen.distance(f) + grown));
      }
    }
    EXPECT_GT(faces, 0.6 * static_cast<double>(held.face_count()));
    // A ray that grazes meets the sphere up to 7 mm beside the face, where it has curved away by 0.7 mm.
    EXPECT_LT(worst, grown == 0 ? 0.1e-3 : 0.75e-3) << grown;
  }
}

TEST(SeenDistance, LeavesOutWhatIsFarOffOrUnseen) {
  const SimulatedCameras cameras = round_the_origin();
  const TriangleMesh sphere = touchfield::sphere(40e-3, 4e-3).mesh;
  const DepthFrame frame = exact_frame(cameras, sphere);
  const TriangleMesh away = transformed(sphere, Eigen::Matrix3d::Identity(), Vector3(0, 0, 0.5));
  EXPECT_EQ(seen_distance(cameras.told(), frame, away).cameras.maxCoeff(), 0);
  const TriangleMesh larger(sphere.vertices() * 1.5, sphere.triangles());
  EXPECT_EQ(seen_distance(cameras.told(), frame, larger).cameras.maxCoeff(), 0);
}

}  // namespace touchfield::seen_distance_test
