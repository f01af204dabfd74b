#include "sim/cameras/hand_tracker.h"

#include <algorithm>
#include <random>

#include <fmt/format.h>

#include "sim/hand/shapes.h"
#include "tests/support/moving_hand_support.h"
#include "tests/support/skin_error.h"
#include "tests/support/testing.h"

namespace touchfield::hand_tracker_test {

constexpr double kFrameTime = 1.0 / 30;

HandShape smaller_hand() {
  HandShape hand{.forearm = 0};
  hand.length = 0.181;
  hand.breadth = 0.082;
  hand.joints.index.mcp = 12 * kDegree;
  hand.joints.index.pip = 15 * kDegree;
  hand.joints.index.dip = 8 * kDegree;
  return hand;
}

HandProportions beyond_the_template() {
  HandProportions by;
  by << 0.03, -0.04, 0.05, 0.06, -0.05, 0.06, 0.04, -0.06, 0.04, -0.05, 0.04, 0.03, -0.05;
  return by;
}

const HandTemplate& mean_hand() {
  static const HandTemplate hand(HandShape{.forearm = 0}, 4.5e-3);
  return hand;
}

const MovingHand& moving_hand() {
  static const MovingHand hand(smaller_hand(), 3e-3);
  return hand;
}

StereoEffects exact() { return {false, false, false, false, false, false, false}; }

/// Cameras, and the tracker that sees by them.
struct Sight {
  explicit Sight(std::size_t count = 3)
      : cameras(first(count), 1), tracker(mean_hand(), cameras.told(), workspace_above_array()) {}
  static std::vector<CameraSpec> first(std::size_t count) {
    std::vector<CameraSpec> specs = cameras_beside_array();
    specs.resize(count);
    return specs;
  }
  DepthFrame at(const MovingHand& hand, int frame, const StereoEffects& effects = {}) const {
    return cameras.sees(hand.mesh(frame * kFrameTime), frame * kFrameTime, static_cast<std::uint64_t>(frame), effects);
  }
  bool learn(const MovingHand& hand, const StereoEffects& effects = {}) {
    std::vector<DepthFrame> frames;
    for (int frame = 0; frame < 30; frame += 7) frames.push_back(at(hand, frame, effects));
    return tracker.learn(frames);
  }
  SkinError error(const HandFit& fit, const MovingHand& hand, int frame) const {
    static const TriangleMesh finer = touchfield::hand(hand_options(mean_hand().hand(), 3e-3)).mesh;
    static const HandTemplate::Carrier carrier = mean_hand().carrier(finer.vertices());
    Points skin;
    tracker.skin(fit, carrier, skin);
    const TriangleMesh truth = hand.mesh(frame * kFrameTime);
    return skin_error(truth, {skin, finer.triangles()}, faces_seen(cameras.told(), truth),
                      {hand.index_pad(frame * kFrameTime), 4e-3});
  }

  SimulatedCameras cameras;
  HandTracker tracker;
};

/// Cameras of which a hand was learnt, and the fit to the next frame.
struct Learnt {
  explicit Learnt(const StereoEffects& effects = {})
      : learnt(sight.learn(moving_hand(), effects)), fit(sight.tracker.track(sight.at(moving_hand(), 26, effects))) {}
  Sight sight;
  bool learnt;
  HandFit fit;
};

const Learnt& learnt_exactly() {
  static const Learnt learnt(exact());
  return learnt;
}

TEST(HandTracker, SeesAHandOfAnotherSizeExactly) {
  const auto& [sight, learnt_it, fit] = learnt_exactly();
  ASSERT_TRUE(learnt_it);
  const HandSkeleton& learnt = sight.tracker.shape().skeleton;
  const HandSkeleton truth = posed_skeleton(hand_pose("index_up"), 0.181, 0.082);
  const auto finger = [](const HandSkeleton& hand) {
    return (hand.fingers[0].joints[3] - hand.fingers[0].joints[0]).norm();
  };
  EXPECT_NEAR(finger(learnt), finger(truth), 0.03 * finger(truth));
  EXPECT_NEAR(learnt.breadth, 0.082, 0.04 * 0.082);
  ASSERT_FALSE(fit.lost);
  const SkinError error = sight.error(fit, moving_hand(), 26);
  EXPECT_LT(error.seen.rms, 0.2e-3);  // with the end at the wrist, which nothing is matched with
  EXPECT_LT(error.patch.rms, 0.15e-3);
  EXPECT_GT(fit.explained, 0.97);
  EXPECT_GT(fit.seen, 0.25);
}

TEST(HandTracker, FollowsAMovingHandThatCamerasSeeWithNoise) {
  for (const bool odd : {false, true}) {
    const MovingHand hand = odd ? MovingHand(smaller_hand(), 3e-3, beyond_the_template(), 2e-3) : moving_hand();
    Sight sight;
    ASSERT_TRUE(sight.learn(hand));
    HandFit fit;
    for (const int frame : {28, 29, 30}) {
      fit = sight.tracker.track(sight.at(hand, frame));
      ASSERT_FALSE(fit.lost) << frame;
    }
    const SkinError error = sight.error(fit, hand, 30);
    EXPECT_LT(error.seen.rms, odd ? 0.5e-3 : 0.3e-3);
    EXPECT_LT(error.seen.p95, odd ? 1.0e-3 : 0.6e-3);
    EXPECT_LT(error.patch.rms, 0.5e-3);
  }
}

// Points do not say how long a digit is where there is no skin: cameras look past an end that is thought to be there.
TEST(HandTracker, LearnsDigitsThatAreShorterOrLonger) {
  for (const double ratio : {-0.22, 0.15}) {
    HandProportions by = HandProportions::Zero();
    by(kDigitRatios + 1) = ratio;
    const MovingHand hand(smaller_hand(), 3e-3, by, 2e-3);
    Sight sight;
    ASSERT_TRUE(sight.learn(hand));
    EXPECT_NEAR(sight.tracker.shape().proportions(kDigitRatios + 1), ratio, 0.05);
    const HandFit fit = sight.tracker.track(sight.at(hand, 26));
    ASSERT_FALSE(fit.lost) << ratio;
    EXPECT_LT(sight.error(fit, hand, 26).patch.rms, 0.5e-3) << ratio;
  }
}

// The template's skin ends at the wrist. With its end matched to the arm the learnt hand was 192 mm long.
TEST(HandTracker, AForearmDoesNotMisleadIt) {
  HandShape with_arm = smaller_hand();
  with_arm.forearm = 0.25;
  const MovingHand hand(with_arm, 3e-3);
  for (const std::size_t cameras : {1, 3}) {
    Sight sight(cameras);
    ASSERT_TRUE(sight.learn(hand));
    EXPECT_NEAR(sight.tracker.shape().skeleton.length, with_arm.length, 3e-3) << cameras;
    const HandFit fit = sight.tracker.track(sight.at(hand, 26));
    ASSERT_FALSE(fit.lost) << cameras;
    EXPECT_LT(sight.error(fit, hand, 26).patch.rms, 0.4e-3) << cameras;
  }
}

// Curled fingers are seen by one camera at their edges alone, where the thumb hides them from its second eye.
TEST(HandTracker, OneCameraFromTheSideDoesNotLoseTheHand) {
  const MovingHand hand(HandShape{.forearm = 0}, 3e-3);
  Sight sight(1);
  ASSERT_TRUE(sight.learn(hand));
  int lost = 0;
  for (int frame = 26; frame < 34; ++frame) {
    lost += sight.tracker.track(sight.at(hand, frame)).lost ? 1 : 0;
  }
  EXPECT_EQ(lost, 0);
}

/// A hand that a template of the mean size is to see.
struct OtherHand {
  const char* pose;
  HandSide side;
  double length = 0.183;  // [m]
};

class OtherHands : public ::testing::TestWithParam<OtherHand> {};

TEST_P(OtherHands, AreFoundAndFollowed) {
  HandShape mean{.forearm = 0};
  mean.pose = GetParam().pose;
  mean.side = GetParam().side;
  HandShape shape = mean;
  shape.length = GetParam().length;
  shape.breadth = 0.45 * shape.length;
  const HandTemplate own(mean, 4.5e-3);
  const MovingHand hand(shape, 4.5e-3);
  std::vector<CameraSpec> specs = cameras_beside_array();
  for (CameraSpec& spec : specs) {
    spec.resolution = {424, 240};
  }
  const SimulatedCameras cameras(specs, 1);
  HandTracker tracker(own, cameras.told(), workspace_above_array());
  const auto at = [&](int frame) {
    return cameras.sees(hand.mesh(frame * kFrameTime), frame * kFrameTime, static_cast<std::uint64_t>(frame));
  };
  ASSERT_TRUE(tracker.learn({at(0), at(7), at(15)}));
  tracker.forget();
  int frame = 30;
  while (tracker.track(at(frame)).lost && frame < 45) {
    ++frame;
  }
  ASSERT_LT(frame, 45) << "not found within half a second";
  for (const int last = frame + 2; frame < last;) {
    const HandFit fit = tracker.track(at(++frame));
    ASSERT_FALSE(fit.lost) << frame;
    Points skin;
    tracker.skin(fit, skin);
    const TriangleMesh truth = hand.mesh(frame * kFrameTime);
    const SkinError error =
        skin_error(truth, {skin, own.mesh().triangles()}, faces_seen(cameras.told(), truth), {Vector3::Zero(), 0});
    EXPECT_LT(error.seen.rms, 0.45e-3);
    EXPECT_LT(error.seen.p95, 0.9e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(HandTracker, OtherHands,
                         ::testing::Values(OtherHand{"index_up", HandSide::kLeft, 0.157},
                                           OtherHand{"grasp", HandSide::kRight},
                                           OtherHand{"flat", HandSide::kRight, 0.213}),
                         [](const auto& of) {
                           return fmt::format("{}_{}_{:.0f}mm", of.param.side == HandSide::kLeft ? "left" : "right",
                                              of.param.pose, of.param.length / kMillimetre);
                         });

/// Pixels that see something beside one that does not see anything, `times` over, and patches up to a fifth of the
/// others.
void add_holes(DepthImage& image, int times, std::mt19937& random) {
  const auto pixel = [&](int i, int j) -> float& {
    return image
        .depth[static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(i)];
  };
  for (; times > 0; --times) {
    const DepthImage before = image;
    for (int j = 1; j + 1 < image.height; ++j) {
      for (int i = 1; i + 1 < image.width; ++i) {
        for (const int next : {-image.width, -1, 1, image.width}) {
          if (before.depth[static_cast<std::size_t>(j * image.width + i + next)] == 0) {
            pixel(i, j) = 0;
          }
        }
      }
    }
  }
  const auto seen = [&] { return std::ranges::count_if(image.depth, [](float depth) { return depth > 0; }); };
  const auto wanted = 4 * seen() / 5;
  while (seen() > wanted) {
    const int column = static_cast<int>(random() % static_cast<unsigned>(image.width));
    const int row = static_cast<int>(random() % static_cast<unsigned>(image.height));
    const int radius = 2 + static_cast<int>(random() % 6);
    for (int j = std::max(row - radius, 0); j <= std::min(row + radius, image.height - 1); ++j) {
      for (int i = std::max(column - radius, 0); i <= std::min(column + radius, image.width - 1); ++i) {
        if ((i - column) * (i - column) + (j - row) * (j - row) < radius * radius) {
          pixel(i, j) = 0;
        }
      }
    }
  }
}

// A stereo camera's images lack outlines and patches. What it did not see is no evidence against the hand.
TEST(HandTracker, SeesAHandThroughHoles) {
  Sight sight;
  std::mt19937 random(1);
  const auto at = [&](int frame) {
    DepthFrame seen = sight.at(moving_hand(), frame);
    for (DepthImage& image : seen.images) {
      add_holes(image, 3, random);
    }
    return seen;
  };
  ASSERT_TRUE(sight.tracker.learn({at(0), at(5), at(10), at(15)}));
  sight.tracker.forget();
  for (const int frame : {20, 21, 22}) {
    const HandFit fit = sight.tracker.track(at(frame));
    ASSERT_FALSE(fit.lost) << lost_text(fit);
    EXPECT_LT(sight.error(fit, moving_hand(), frame).seen.rms, 0.6e-3);
  }
}

TEST(HandTracker, SaysWhichFacesWereSeen) {
  const auto& [sight, learnt_it, fit] = learnt_exactly();
  ASSERT_TRUE(learnt_it);
  const Eigen::VectorXd confidence = sight.tracker.confidence(fit);
  Points skin;
  sight.tracker.skin(fit, skin);
  const TriangleMesh mesh(skin, mean_hand().mesh().triangles());
  const std::vector<bool> well = faces_seen(sight.cameras.told(), mesh, 60 * kDegree);
  const std::vector<bool> at_all = faces_seen(sight.cameras.told(), mesh, 85 * kDegree);
  double believed = 0;
  double rightly = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const auto face = static_cast<std::size_t>(f);
    if (well[face]) {
      EXPECT_GT(confidence(f), 0) << f;
    }
    if (confidence(f) > 0.99) {
      believed += 1;
      rightly += at_all[face] ? 1 : 0;
    }
  }
  EXPECT_GT(rightly, 0.97 * believed);
  EXPECT_GT(believed, 500);
}

TEST(HandTracker, IsLostWhenTheHandLeavesAndFindsItAgain) {
  Learnt same(exact());
  ASSERT_TRUE(same.learnt);
  Sight& sight = same.sight;
  DepthFrame nothing = sight.at(moving_hand(), 26);
  for (DepthImage& image : nothing.images) {
    std::ranges::fill(image.depth, 0.0F);
  }
  const HandFit& followed = same.fit;
  EXPECT_FALSE(followed.lost);
  EXPECT_EQ(lost_text(followed), "");
  for (const int confirmed : followed.confirmed) {  // by each camera
    EXPECT_GT(confirmed, 100);
  }
  const HandFit lost = sight.tracker.track(nothing);
  EXPECT_TRUE(lost.lost);
  EXPECT_EQ(lost_text(lost), "points in the search box 0 (150 required)");
  EXPECT_EQ(sight.tracker.confidence(lost).sum(), 0);
  EXPECT_TRUE(sight.tracker.track(nothing).lost);
  int frame = 60;
  HandFit fit;
  do {
    fit = sight.tracker.track(sight.at(moving_hand(), frame++));
  } while (fit.lost && frame < 75);
  ASSERT_FALSE(fit.lost) << "within half a second";
  fit = sight.tracker.track(sight.at(moving_hand(), frame));
  ASSERT_FALSE(fit.lost);
  EXPECT_LT(sight.error(fit, moving_hand(), frame).seen.rms, 0.6e-3);

  // The same frames give the same fit.
  EXPECT_EQ(learnt_exactly().fit.pose(), followed.pose());
  EXPECT_EQ(learnt_exactly().fit.deformation, followed.deformation);
}

TEST(HandTracker, TakesNothingElseForAHand) {
  Sight sight;
  const TriangleMesh ball = transformed(sphere(0.05, 5e-3).mesh, Eigen::Matrix3d::Identity(), Vector3(0, -0.05, 0.2));
  const TriangleMesh stick =
      transformed(capsule(0.03, 0.2, 5e-3).mesh, Eigen::Matrix3d::Identity(), Vector3(0, -0.05, 0.2));
  for (const TriangleMesh& thing : {ball, stick}) {
    sight.tracker.forget();
    for (int frame = 0; frame < 3; ++frame) {
      EXPECT_TRUE(
          sight.tracker.track(sight.cameras.sees(thing, frame * kFrameTime, static_cast<std::uint64_t>(frame))).lost)
          << frame;
    }
  }
}

}  // namespace touchfield::hand_tracker_test
