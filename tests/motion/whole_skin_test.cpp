#include <gtest/gtest.h>

#include "sim/core/units.h"
#include "sim/motion/moving_model.h"
#include "tests/support/moving_support.h"
#include "tests/support/scene_support.h"

namespace touchfield::whole_skin_test {

const std::string kCutFinger =
    "name: bending\n"
    "array: {grid: {count: [12, 10], pitch_mm: 10.16}}\n"
    "body:\n"
    "  hand: {pose: index_up}\n"
    "  place: {landmark: index_pad, at_mm: [0, 0, 120]}\n"
    "  edge_mm: {near_target: 2.5, far: 5, within_mm: 8}\n"
    "  keep_within_mm: 35\n"
    "target: {box: {at: index_pad, size_mm: [7, 7, 6]}, pressure_pa: 1500}\n"
    "solve: {methods: [surface], scheme: chief}\n"
    "motion:\n"
    "  seconds: 0.5\n"
    "  solve_ms: 20\n"
    "  change:\n"
    "    - {path: 'body.place.at_mm[0]', rate: 40}\n"
    "    - {path: body.hand.joints.index.dip_deg, keys: [[0, 0], [0.5, 30]]}\n";

TEST(WholeSkin, IsTheHandThatTheSolverSeesAPartOf) {
  const MovingModel moving(scene_from(kCutFinger));
  const WholeSkin whole(moving.first());
  const auto size = [](const TriangleMesh& mesh) {
    return (mesh.vertices().rowwise().maxCoeff() - mesh.vertices().rowwise().minCoeff()).norm();
  };
  for (const double seconds : {0.0, 0.5}) {
    const MotionState state = moving.state(seconds);
    const Model model = moving.at(state);
    const TriangleMesh skin = whole.at(model, state);
    EXPECT_GT(size(skin), 0.15);
    EXPECT_LT(size(model.body.mesh), 0.1);
    EXPECT_GT(skin.signed_volume(), 5 * model.body.mesh.signed_volume());
    double farthest = 0;
    for (Eigen::Index f = 0; f < model.body.mesh.face_count(); f += 7) {
      if (model.fixed->skin[static_cast<std::size_t>(f)] != 0) {
        const Vector3 corner = model.body.mesh.corner(f, 0);
        farthest = std::max(farthest, (position(skin, nearest_landmark(skin, "", corner)) - corner).norm());
      }
    }
    EXPECT_LT(farthest, 0.5 * kMillimetre);
  }
}

TEST(WholeSkin, IsOfBodiesWithoutJointsToo) {
  const MovingModel moving(scene_from(kMovingCapsule));
  const WholeSkin whole(moving.first());
  const MotionState state = moving.state(0.2);
  const Model model = moving.at(state);
  const TriangleMesh skin = whole.at(model, state);
  EXPECT_NEAR(skin.signed_volume(), model.body.mesh.signed_volume(), 0.02 * skin.signed_volume());
  EXPECT_NEAR(skin.centroids().row(0).mean(), 0.01, 1e-4);
}

}  // namespace touchfield::whole_skin_test
