#include "sim/hand/skinned_hand.h"

#include <limits>
#include <map>
#include <ostream>
#include <random>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_contact.h"
#include "sim/hand/hand_pose.h"
#include "sim/mesh/query/self_intersections.h"
#include "tests/support/hand_support.h"
#include "tests/support/random_support.h"
#include "tests/support/testing.h"

namespace touchfield::skinned_hand_test {

constexpr double kMm = kMillimetre;

HandOptions options_of(const std::string& pose, HandSide side = HandSide::kRight) {
  HandOptions options;
  options.pose = pose;
  options.edge = 5 * kMm;
  options.side = side;
  return options;
}

HandSkeleton skeleton_of(const HandOptions& options) {
  return posed_skeleton(hand_pose(options.pose, options.joints), options.length, options.breadth);
}

/// A template and what is made of it, once for each pose.
struct Skinned {
  explicit Skinned(const HandOptions& options, const EdgeSizing& sizing = EdgeSizing(5 * kMm))
      : body(hand(options, sizing)),
        skeleton(skeleton_of(options)),
        skin(body.mesh.vertices(), skeleton, options.side),
        contacts(skeleton, options.side) {}

  Points posed(const HandOptions& options) const {
    Points vertices;
    skin.pose(skeleton_of(options), body.mesh.triangles(), vertices);
    return vertices;
  }

  Body body;
  HandSkeleton skeleton;
  SkinnedHand skin;
  HandContacts contacts;
};

const Skinned& skinned(const std::string& pose, HandSide side = HandSide::kRight) {
  static std::map<std::pair<std::string, HandSide>, Skinned> made;
  const auto key = std::pair(pose, side);
  const auto found = made.find(key);
  return found != made.end() ? found->second : made.emplace(key, Skinned(options_of(pose, side))).first->second;
}

/// A flat hand with its index finger bent and its thumb moved, free of contact.
HandOptions bent(HandSide side = HandSide::kRight) {
  HandOptions options = options_of("flat", side);
  options.joints.index = {15 * kDegree, 35 * kDegree, 50 * kDegree, 20 * kDegree};
  options.joints.thumb.cmc_abduction = 35 * kDegree;
  options.joints.thumb.ip = 40 * kDegree;
  return options;
}

TEST(SkinnedHand, StaysAsItIsInThePoseThatItWasMeshedIn) {
  for (const char* pose : {"flat", "index_up"}) {
    const Points vertices = skinned(pose).posed(options_of(pose));
    EXPECT_LT((vertices - skinned(pose).body.mesh.vertices()).cwiseAbs().maxCoeff(), 1e-12) << pose;
    EXPECT_FALSE(skinned(pose).contacts.at(skinned(pose).skeleton)) << pose;
  }
}

// What hangs on one bone alone turns with it, to rounding; what hangs on the palm alone stays.
TEST(SkinnedHand, EndsMoveRigidlyWithTheirBone) {
  const Skinned& flat = skinned("flat");
  const HandSkeleton before = right_hand(flat.skeleton);
  const HandSkeleton after = right_hand(skeleton_of(bent()));
  const Points posed = flat.posed(bent());
  const auto frame = [](const BoneChain& chain) {
    Eigen::Matrix3d axes;
    axes << chain.direction(2), chain.palmar[2], chain.direction(2).cross(chain.palmar[2]);
    return axes;
  };
  const BoneChain& was = before.fingers[0];
  const BoneChain& is = after.fingers[0];
  int at_tip = 0;
  int at_wrist = 0;
  for (Eigen::Index v = 0; v < posed.cols(); ++v) {
    const Vector3 x = flat.body.mesh.vertices().col(v);
    if ((x - was.joints[3]).norm() < 8 * kMm) {
      const Vector3 expected = is.joints[2] + frame(is) * frame(was).transpose() * (x - was.joints[2]);
      EXPECT_LT((posed.col(v) - expected).norm(), 1e-12);
      ++at_tip;
    } else if (x.y() < -15 * kMm && x.x() > 0) {
      EXPECT_LT((posed.col(v) - x).norm(), 1e-12);
      ++at_wrist;
    }
  }
  EXPECT_GT(at_tip, 5);
  EXPECT_GT(at_wrist, 5);
}

TEST(SkinnedHand, TheLeftHandIsTheMirrorImage) {
  const Skinned& right = skinned("flat");
  const Skinned& left = skinned("flat", HandSide::kLeft);
  Points mirrored = right.posed(bent());
  mirrored.row(0) *= -1.0;
  const Points posed = left.posed(bent(HandSide::kLeft));
  EXPECT_LT((posed - mirrored).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_THAT(left.skin.inverted_faces(skeleton_of(bent()), posed, left.body.mesh.triangles()), IsEmpty());

  HandOptions closed = options_of("flat");
  closed.joints.index.abduction = -15 * kDegree;
  const auto of_right = right.contacts.at(skeleton_of(closed));
  const auto of_left = left.contacts.at(skeleton_of(closed));
  ASSERT_TRUE(of_right && of_left);
  EXPECT_EQ(of_left->at, Vector3(-of_right->at.x(), of_right->at.y(), of_right->at.z()));
}

TEST(SkinnedHand, FindsInvertedFaces) {
  for (const HandSide side : {HandSide::kRight, HandSide::kLeft}) {
    const Skinned& flat = skinned("flat", side);
    Points posed = flat.posed(bent(side));
    const Triangles& triangles = flat.body.mesh.triangles();
    EXPECT_THAT(flat.skin.inverted_faces(skeleton_of(bent()), posed, triangles), IsEmpty());
    const Eigen::Index face = 100;  // its corner goes over to the other side of the edge across
    const Vector3 middle = 0.5 * (posed.col(triangles(1, face)) + posed.col(triangles(2, face)));
    posed.col(triangles(0, face)) += 2.0 * (middle - posed.col(triangles(0, face)));
    EXPECT_THAT(flat.skin.inverted_faces(skeleton_of(bent()), posed, triangles), Contains(face));
    const auto fold = fold_of(flat.skin, skeleton_of(bent()), posed, triangles);
    ASSERT_TRUE(fold);
    EXPECT_EQ(fold->kind, ContactKind::kFolded);
  }
}

TEST(SkinnedHand, RefusesWhatIsNoHandOfItsSize) {
  const HandSkeleton flat = skeleton_of(options_of("flat"));
  EXPECT_THAT([&] { SkinnedHand(Points(3, 0), flat); }, ThrowsMessage<InputError>(HasSubstr("0 vertices")));
  Points odd = Points::Zero(3, 2);
  odd(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT([&] { SkinnedHand(odd, flat); }, ThrowsMessage<InputError>(HasSubstr("finite")));
  HandOptions larger = options_of("flat");
  larger.length = 0.2;
  EXPECT_THAT([&] { skinned("flat").posed(larger); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("0.2 m long"), HasSubstr("0.1933 m"))));
}

TEST(HandContacts, SayWhatMeetsMovesAndStretches) {
  const auto found = [](const HandOptions& options) {
    const auto contact = skinned(options.pose).contacts.at(skeleton_of(options));
    return contact ? contact_text(*contact) : "";
  };
  EXPECT_EQ(found(bent()), "");
  const auto turned = [&](const std::string& pose, const auto& turn) {
    HandOptions options = options_of(pose);
    turn(options.joints);
    return found(options);
  };
  EXPECT_THAT(turned("flat", [](HandJoints& j) { j.index.abduction = -15 * kDegree; }),
              AllOf(HasSubstr("index finger and"), HasSubstr("of the middle finger come into contact")));
  const auto pinch = [](HandJoints& j) {
    j.thumb = {16 * kDegree, 50 * kDegree, 75 * kDegree, 7 * kDegree, 20 * kDegree};
    j.index = {-4 * kDegree, 55 * kDegree, 40 * kDegree, 20 * kDegree};
  };
  EXPECT_THAT(turned("flat", pinch), HasSubstr("of the thumb and"));
  const auto into_palm = [](HandJoints& j) { j.ring = {{}, {}, 100 * kDegree, 60 * kDegree}; };
  EXPECT_THAT(turned("flat", into_palm), HasSubstr("distal phalanx of the ring finger and"));
  EXPECT_THAT(turned("flat", [](HandJoints& j) { j.index.mcp = 85 * kDegree; }),
              AllOf(HasSubstr("index finger"), HasSubstr("turn farther")));
  // The thumb lies over the curled fingers: a finger opened, or the thumb lifted, tears them apart.
  EXPECT_THAT(turned("index_up", [](HandJoints& j) { j.middle.pip = 60 * kDegree; }),
              HasSubstr("move against each other"));
  EXPECT_EQ(turned("index_up", [](HandJoints& j) { j.index.mcp = 10 * kDegree; }), "");
}

/// Angles anywhere in their ranges.
HandOptions random_hand(std::mt19937& random) {
  HandOptions options = options_of("flat");
  for (const HandJoint& joint : all_joints()) {
    joint.turn(options.joints, uniform(random, joint.least, joint.most) * kDegree);
  }
  return options;
}

// On the last 20 degrees of the way to a pose in which faces turn over as skinned, the vertices that are mended never
// jump between poses 0.1 degrees apart, and all others are where skinning alone has them.
TEST(SkinnedHand, MendsFacesThatTurnOver) {
  const Skinned& flat = skinned("flat");
  const Triangles& triangles = flat.body.mesh.triangles();
  Points plain;
  std::mt19937 random(20);
  HandOptions options;
  HandSkeleton end;
  do {
    options = random_hand(random);
    end = skeleton_of(options);
    flat.skin.pose(end, plain);
  } while (flat.contacts.at(end) || flat.skin.inverted_faces(end, plain, triangles).empty());
  const HandPose start = hand_pose("flat");
  const JointAngles turn = joint_angles(hand_pose("flat", options.joints)) - joint_angles(start);
  Points before;
  for (int step = -200; step <= 0; ++step) {
    const double share = 1.0 + step * 0.1 * kDegree / turn.cwiseAbs().maxCoeff();
    const HandSkeleton skeleton =
        posed_skeleton(with_angles(start, joint_angles(start) + share * turn), options.length, options.breadth);
    Points posed;
    flat.skin.pose(skeleton, triangles, posed);
    flat.skin.pose(skeleton, plain);
    EXPECT_THAT(flat.skin.inverted_faces(skeleton, posed, triangles), IsEmpty()) << step;
    EXPECT_LT(((posed - plain).colwise().norm().array() > 0).count(), 10) << step;
    if (step > -200) {
      EXPECT_LT((posed - before).colwise().norm().maxCoeff(), 0.6 * kMm) << step;  // 0.2 as skinned
    }
    before = posed;
  }
}

struct RandomPoses {
  int free;     // poses without contact
  int volumes;  // of them are compared with the implicit hand, which takes seconds each
  int any;      // poses as they are drawn
};

void PrintTo(const RandomPoses& poses, std::ostream* out) { *out << poses.free << " free"; }

class SkinnedPoses : public ::testing::TestWithParam<RandomPoses> {};

/// How many of some poses without contact cut themselves; in none a face turns over, and the first keep their volume.
int cuts_of_free_poses(const Skinned& flat, double forearm, int poses, int volumes) {
  const Triangles& triangles = flat.body.mesh.triangles();
  std::mt19937 random(20);
  int cut = 0;
  for (int pose = 0; pose < poses;) {
    HandOptions options = random_hand(random);
    options.forearm = forearm;
    const HandSkeleton skeleton = skeleton_of(options);
    if (flat.contacts.at(skeleton)) {
      continue;
    }
    const Points vertices = flat.posed(options);
    EXPECT_THAT(flat.skin.inverted_faces(skeleton, vertices, triangles), IsEmpty()) << pose;
    const TriangleMesh mesh(vertices, triangles);
    if (!self_intersections(mesh, 1).empty()) {
      EXPECT_TRUE(fold_of(flat.skin, skeleton, vertices, triangles)) << pose;
      ++cut;
    }
    if (pose < volumes) {
      EXPECT_NEAR(mesh.signed_volume() / hand(options).mesh.signed_volume(), 1.0, 0.03) << pose;
    }
    ++pose;
  }
  return cut;
}

TEST_P(SkinnedPoses, FreeOnesKeepVolumeAndOrientation) {
  EXPECT_LE(cuts_of_free_poses(skinned("flat"), 0, GetParam().free, GetParam().volumes), GetParam().free / 100);
}

// Faces of 12 mm, graded, with a forearm; the cuts are between ring and little finger.
TEST(SkinnedHand, CarriesCoarseMeshes) {
  HandOptions options = options_of("flat");
  options.forearm = 100 * kMm;
  const Vector3 pad = hand_landmark(options, "index_pad");
  const Skinned coarse(options, EdgeSizing(12 * kMm, {{pad, 2.4 * kMm, 15 * kMm}}));
  EXPECT_LE(cuts_of_free_poses(coarse, options.forearm, 30, 1), 4);
}

TEST_P(SkinnedPoses, WhatCutsItselfIsFound) {
  const Skinned& flat = skinned("flat");
  std::mt19937 random(21);
  int cut = 0;
  for (int pose = 0; pose < GetParam().any; ++pose) {
    const HandOptions options = random_hand(random);
    const Points vertices = flat.posed(options);
    const TriangleMesh mesh(vertices, flat.body.mesh.triangles());
    if (!self_intersections(mesh, 1).empty()) {
      const HandSkeleton skeleton = skeleton_of(options);
      EXPECT_TRUE(flat.contacts.at(skeleton) || fold_of(flat.skin, skeleton, vertices, mesh.triangles())) << pose;
      ++cut;
    }
  }
  EXPECT_GT(cut, GetParam().any / 2);  // most poses drawn without regard to each other do
}

INSTANTIATE_TEST_SUITE_P(Small, SkinnedPoses, ::testing::Values(RandomPoses{30, 1, 50}));
INSTANTIATE_TEST_SUITE_P(Full, SkinnedPoses, ::testing::Values(RandomPoses{200, 200, 400}));

}  // namespace touchfield::skinned_hand_test
