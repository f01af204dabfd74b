#include <gtest/gtest.h>

#include "sim/cameras/hand_tracker.h"
#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/moving_hand_support.h"
#include "tests/support/skin_error.h"

namespace touchfield::lost_hand_test {

enum class Beside { kNothing, kBall, kSleeve };

/// How many frames of a hand that leaves the view and returns, again and again.
struct Coming {
  int frames;
  Beside beside;
  std::array<int, 2> resolution = {640, 360};
};

class ComingHand : public ::testing::TestWithParam<Coming> {};

/// The hand stands still in the middle, goes, stays away and comes back, within 100 frames.
double away(int frame) {
  const int of_period = frame % 100;
  if (of_period < 35) return 0;
  constexpr double kFarthest = 0.45;  // [m]
  return of_period < 60   ? kFarthest * (of_period - 35) / 25
         : of_period < 65 ? kFarthest
         : of_period < 80 ? kFarthest * (80 - of_period) / 15
                          : 0;
}

TEST_P(ComingHand, IsNeverWrongWithoutBeingLost) {
  constexpr double kFrameTime = 1.0 / 30;
  static const HandTemplate hand_template(HandShape{.forearm = 0}, 4.5e-3);
  HandShape smaller{.forearm = 0};
  smaller.length = 0.181;
  smaller.breadth = 0.082;
  static const MovingHand hand(smaller, 4.5e-3);
  const TriangleMesh ball = sphere(0.03, 6e-3).mesh;
  const TriangleMesh forearm = capsule(0.032, 0.25, 8e-3).mesh;
  std::vector<CameraSpec> specs = cameras_beside_array();
  for (CameraSpec& spec : specs) spec.resolution = GetParam().resolution;
  const SimulatedCameras cameras(specs, 1);
  HandTracker tracker(hand_template, cameras.told(), workspace_above_array());
  const auto scene_at = [&](int frame) {
    const double seconds = frame * kFrameTime;
    const TriangleMesh here = hand.mesh(seconds);
    const HandState state = hand.state(seconds);
    const auto with = [&](const TriangleMesh& thing, const Vector3& in_hand) {
      const Eigen::Matrix3d along_arm = Eigen::AngleAxisd(-0.5 * std::numbers::pi, Vector3::UnitX()).toRotationMatrix();
      return together(here, transformed(thing, state.place.rotation * along_arm, state.place(in_hand)));
    };
    switch (GetParam().beside) {
      case Beside::kBall:
        return with(ball, {0.02 + 0.1 * std::sin(2 * seconds), 0.12, -0.08});
      case Beside::kSleeve:
        return with(forearm, {0, -0.135, 0});
      case Beside::kNothing:
        break;
    }
    return here;
  };
  std::vector<DepthFrame> first;
  for (int frame = 0; frame < 30; frame += 5) {
    first.push_back(cameras.sees(scene_at(frame), frame * kFrameTime, static_cast<std::uint64_t>(frame)));
  }
  ASSERT_TRUE(tracker.learn(first));
  int wrong = 0;
  int seen_again = 0;  // frames since the hand is back
  int slow = 0;        // times that it was not found within half a second
  int lost_in_view = 0;
  for (int frame = 30; frame < GetParam().frames; ++frame) {
    const Vector3 shift(away(frame), 0, 0);
    const Eigen::Matrix3d same = Eigen::Matrix3d::Identity();
    const DepthFrame seen =
        cameras.sees(transformed(scene_at(frame), same, shift), frame * kFrameTime, static_cast<std::uint64_t>(frame));
    const HandFit fit = tracker.track(seen);
    seen_again = shift.x() > 0 ? 0 : seen_again + 1;
    slow += seen_again == 15 && fit.lost ? 1 : 0;
    lost_in_view += seen_again > 15 && fit.lost ? 1 : 0;
    if (fit.lost) continue;
    Points skin;
    tracker.skin(fit, skin);
    const TriangleMesh truth = transformed(hand.mesh(frame * kFrameTime), same, shift);
    const SkinError error = skin_error(truth, {skin, hand_template.mesh().triangles()},
                                       faces_seen(cameras.told(), truth), {Vector3::Zero(), 0});
    if (error.seen.area > 0 && !(error.seen.rms < 5e-3)) {
      ++wrong;
      ADD_FAILURE() << "frame " << frame << ": " << 1e3 * error.seen.rms << " mm, explained " << fit.explained
                    << ", share " << fit.share << ", residual " << 1e3 * fit.residual << " mm, seen " << fit.seen;
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(slow, 0);
  EXPECT_EQ(lost_in_view, 0);
}

INSTANTIATE_TEST_SUITE_P(Short, ComingHand, ::testing::Values(Coming{100, Beside::kSleeve, {424, 240}}));
INSTANTIATE_TEST_SUITE_P(Full, ComingHand,
                         ::testing::Values(Coming{1000, Beside::kNothing}, Coming{500, Beside::kBall},
                                           Coming{500, Beside::kSleeve}));

}  // namespace touchfield::lost_hand_test
