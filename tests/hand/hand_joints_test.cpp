#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_pose.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "tests/support/hand_support.h"
#include "tests/support/joint_support.h"
#include "tests/support/testing.h"

namespace touchfield::hand_joints_test {

constexpr double kMm = kMillimetre;

/// Of a right hand.
HandSkeleton skeleton_of(const HandOptions& options) {
  return right_hand(posed_skeleton(hand_pose(options.pose, options.joints), options.length, options.breadth));
}

HandOptions flat_hand() {
  HandOptions options;
  options.pose = "flat";
  return options;
}

// The finger is turned about its knuckle as a whole.
TEST(HandJoints, TurnTheFingerAboutItsJoint) {
  HandOptions options = flat_hand();
  const BoneChain before = skeleton_of(options).fingers[0];
  const double flat_mcp = hand_pose("flat").fingers[0].mcp;
  options.joints.index.mcp = 43 * kDegree;
  const BoneChain after = skeleton_of(options).fingers[0];
  // The fingers' lean grows with flexion, less than 3 degrees here: it is part of the turn.
  const double turn = std::acos(before.direction(2).dot(after.direction(2)));
  EXPECT_NEAR(turn, 43 * kDegree - flat_mcp, 1.5 * kDegree);
  EXPECT_EQ(after.joints[0], before.joints[0]);
  EXPECT_NEAR(after.direction(0).dot(after.direction(2)), before.direction(0).dot(before.direction(2)), 1e-12);
  EXPECT_LT(after.joints[3].z(), before.joints[3].z() - 50 * kMm);  // towards the palm side

  options.joints.index = {};
  options.joints.index.abduction = 37 * kDegree;
  const BoneChain spread = skeleton_of(options).fingers[0];
  EXPECT_NEAR(std::acos(spread.direction(0).dot(before.direction(0))),
              37 * kDegree - hand_pose("flat").fingers[0].abduction, 0.1 * kDegree);
  EXPECT_LT(spread.joints[3].x(), before.joints[3].x() - 20 * kMm);  // towards the thumb

  // Abduction leads away from the middle finger, on both its sides.
  options.joints = {};
  options.joints.ring.abduction = 20 * kDegree;
  options.joints.little.abduction = 40 * kDegree;
  const HandSkeleton both = skeleton_of(options);
  EXPECT_GT(both.fingers[2].joints[3].x(), skeleton_of(flat_hand()).fingers[2].joints[3].x() + 10 * kMm);
  EXPECT_GT(both.fingers[3].joints[3].x(), skeleton_of(flat_hand()).fingers[3].joints[3].x() + 20 * kMm);
}

// The metacarpal's direction as the header has it; and the skin follows the bones.
TEST(HandJoints, TurnTheThumb) {
  HandOptions options = flat_hand();
  for (const auto& [flexion, abduction] : {std::pair{0.0, 0.0}, {-25.0, 0.0}, {35.0, 20.0}, {10.0, 60.0}}) {
    options.joints.thumb.cmc_flexion = flexion * kDegree;
    options.joints.thumb.cmc_abduction = abduction * kDegree;
    const double aside = (20 - flexion) * kDegree;
    const double out = abduction * kDegree;
    const Vector3 expected(-std::sin(aside) * std::cos(out), std::cos(aside) * std::cos(out), -std::sin(out));
    EXPECT_LT((skeleton_of(options).thumb.direction(0) - expected).norm(), 1e-12);
  }
  options.joints.thumb = {0.0, 0.0, 0.0, 0.0, 0.0};
  EXPECT_LT((skeleton_of(options).thumb.palmar[2] - Vector3(std::cos(20 * kDegree), std::sin(20 * kDegree), 0)).norm(),
            1e-12);  // the pad faces the little finger
  options.joints.thumb.cmc_rotation = -60 * kDegree;
  EXPECT_LT(skeleton_of(options).thumb.palmar[2].z(), -0.5);
  options.joints.thumb.ip = 60 * kDegree;
  const HandSkeleton skeleton = skeleton_of(options);
  EXPECT_NEAR(skeleton.thumb.direction(1).dot(skeleton.thumb.direction(2)), std::cos(60 * kDegree), 1e-12);
  EXPECT_LT((hand_landmark(options, "thumb_tip") - skeleton.thumb.joints[3]).norm(), 0.6 * kMm);
}

TEST(HandJoints, RefuseAnglesOutOfTheirRange) {
  for (const HandJoint& joint : all_joints()) {
    for (const double outside : {joint.least - 1, joint.most + 1, std::nan("")}) {
      HandJoints joints;
      joint.turn(joints, outside * kDegree);
      EXPECT_THAT([&] { hand_pose("flat", joints); },
                  ThrowsMessage<InputError>(
                      AllOf(HasSubstr("hand.joints." + joint.name + " = "),
                            HasSubstr(fmt::format("must be {} to {} degrees", joint.least, joint.most)))));
    }
    for (const double end : {joint.least, joint.most}) {
      HandJoints joints;
      joint.turn(joints, end * kDegree);
      EXPECT_NO_THROW(hand_pose("flat", joints)) << joint.name;
    }
  }
}

// A pose given as joint angles is that pose, and every pose keeps within the ranges.
TEST(HandJoints, ThePosesKeepWithinTheRanges) {
  const auto as_joints = [](const FingerAngles& f) { return FingerJoints{f.abduction, f.mcp, f.pip, f.dip}; };
  for (const HandPose& pose : hand_pose_table()) {
    const ThumbAngles& t = pose.thumb;
    HandOptions options;
    options.pose = "flat";
    options.joints = {{t.cmc_flexion, t.cmc_abduction, t.cmc_rotation, t.mcp, t.ip},
                      as_joints(pose.fingers[0]),
                      as_joints(pose.fingers[1]),
                      as_joints(pose.fingers[2]),
                      as_joints(pose.fingers[3])};
    const HandSkeleton from_joints = skeleton_of(options);
    options = {};
    options.pose = pose.name;
    const HandSkeleton from_pose = skeleton_of(options);
    EXPECT_EQ(from_joints.thumb.joints[3], from_pose.thumb.joints[3]) << pose.name;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(from_joints.fingers[i].joints[3], from_pose.fingers[i].joints[3]) << pose.name;
    }
  }
}

// Angles drawn without any regard to each other: parts of the hand lie across and within each other.
TEST(HandJoints, AnyAnglesGiveASoundSkinOrAClearError) {
  constexpr int kDraws = 5;
  std::mt19937_64 random(1);
  int sound = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    HandOptions options;
    options.edge = 8e-3;
    for (const HandJoint& joint : all_joints()) {
      const double share = static_cast<double>(random() >> 11) * 0x1p-53;
      joint.turn(options.joints, (joint.least + share * (joint.most - joint.least)) * kDegree);
    }
    try {
      const Body body = hand(options);
      const MeshReport report = inspect(body.mesh);
      EXPECT_THAT(report.faults, IsEmpty()) << draw;
      EXPECT_EQ(report.components, 1) << draw;
      EXPECT_THAT(self_intersections(body.mesh), IsEmpty()) << draw;
      EXPECT_GT(report.volume, 250e-6) << draw;  // of 340 cm3 spread out
      ++sound;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("the skin intersects itself near")) << draw;
    }
  }
  EXPECT_GE(sound, kDraws - 1);  // the error is the exception
}

// The table's lengths in proportion; and the hand as long as is asked for, from the crease to the middle fingertip.
TEST(HandSkeleton, HasThePublishedProportions) {
  constexpr std::array<std::array<double, 3>, 4> kBones = {{{39.78, 22.38, 15.82 + 3.84},
                                                            {44.63, 26.33, 17.40 + 3.95},
                                                            {41.37, 25.65, 17.30 + 3.95},
                                                            {32.74, 18.11, 15.96 + 3.73}}};
  for (const std::string& pose : hand_poses()) {
    const HandSkeleton skeleton = posed_skeleton(hand_pose(pose), HandOptions().length, HandOptions().breadth);
    const double scale = (skeleton.fingers[1].joints[1] - skeleton.fingers[1].joints[0]).norm() / 44.63;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t bone = 0; bone < 3; ++bone) {
        const double length = (skeleton.fingers[i].joints[bone + 1] - skeleton.fingers[i].joints[bone]).norm();
        EXPECT_NEAR(length / scale, kBones[i][bone], 1e-9);
      }
    }
    const auto& thumb = skeleton.thumb.joints;
    EXPECT_NEAR((thumb[1] - thumb[0]).norm() / scale, 46.22, 1e-9);
    EXPECT_NEAR((thumb[2] - thumb[1]).norm() / scale, 31.57, 1e-9);
    EXPECT_NEAR((thumb[3] - thumb[2]).norm() / scale, 21.67 + 5.67, 1e-9);
    const double finger = scale * (44.63 + 26.33 + 17.40 + 3.95);
    EXPECT_NEAR(finger + (0.373 + 0.073) * 193.3 * kMm, 193.3 * kMm, 1e-12);
  }
}

}  // namespace touchfield::hand_joints_test
