#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_flesh.h"
#include "sim/hand/hand_pose.h"
#include "sim/hand/skinned_hand.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "tests/support/joint_support.h"
#include "tests/support/testing.h"

namespace touchfield::forearm_test {

constexpr double kMm = kMillimetre;
constexpr double kHandEnd = -20 * kMm;  // y

HandOptions options_of(const std::string& pose, double forearm, double edge = 5 * kMm) {
  HandOptions options;
  options.pose = pose;
  options.forearm = forearm;
  options.edge = edge;
  return options;
}

/// Length of the line in which a plane across the forearm cuts the skin, so far behind the wrist joint.
double girth(const TriangleMesh& mesh, double behind) {
  double sum = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    Vector3 first = Vector3::Zero();
    int crossings = 0;
    for (int c = 0; c < 3; ++c) {
      const Vector3 a = mesh.corner(f, c);
      const Vector3 b = mesh.corner(f, (c + 1) % 3);
      const double from = a.y() + behind;
      const double to = b.y() + behind;
      if ((from < 0) != (to < 0)) {
        const Vector3 at = a + (b - a) * (from / (from - to));
        sum += crossings == 1 ? (at - first).norm() : 0;
        first = at;
        ++crossings;
      }
    }
  }
  return sum;
}

// ANSUR II, means of men and women: hand length and breadth, circumferences of the wrist and of the flexed forearm.
TEST(Forearm, HasThePublishedGirths) {
  struct Person {
    double length, breadth, wrist, forearm;  // [mm]
  };
  for (const Person& person : {Person{193.3, 88.3, 175.9, 310.1}, Person{181.1, 78.2, 154.8, 264.1}}) {
    HandOptions options = options_of("flat", 240 * kMm, 3 * kMm);
    options.length = person.length * kMm;
    options.breadth = person.breadth * kMm;
    const TriangleMesh mesh = hand(options).mesh;
    EXPECT_NEAR(girth(mesh, 0.1 * kMm) / (person.wrist * kMm), 1.0, 0.03);
    double greatest = 0;
    double before = 0;
    for (double behind = 30 * kMm; behind < 250 * kMm; behind += 5 * kMm) {
      const double here = girth(mesh, behind);
      if (behind < 0.95 * options.length) {
        EXPECT_GT(here, before - 0.5 * kMm) << behind;
      }
      greatest = std::max(greatest, here);
      before = here;
    }
    EXPECT_NEAR(greatest / (person.forearm * kMm), 1.0, 0.04);
  }
}

// 1.62 % of a man's 85.5 kg (de Leva, J. Biomech. 29 (1996) 1223; ANSUR II), at 1.1 kg/l, between wrist and elbow.
TEST(Forearm, HasThePublishedVolume) {
  const double to_elbow = 1.36 * HandOptions{}.length + kHandEnd;
  const double with = hand(options_of("flat", to_elbow)).mesh.signed_volume();
  EXPECT_NEAR((with - hand(options_of("flat", 0)).mesh.signed_volume()) / 1.26e-3, 1.0, 0.1);
}

/// A pose and a length of forearm.
class ForearmPoses : public ::testing::TestWithParam<std::pair<std::string, double>> {};

TEST_P(ForearmPoses, EndsClosedAndLeavesTheHandAsItIs) {
  const auto& [pose, forearm] = GetParam();
  const Body plain = hand(options_of(pose, 0));
  const Eigen::VectorXd own_distances = hand_distances(options_of(pose, 0), plain.mesh.vertices());
  std::map<std::string, Vector3> own_landmarks;  // all at once: the body of the last options is kept
  for (const std::string& name : hand_landmark_names()) {
    own_landmarks[name] = hand_landmark(options_of(pose, 0), name);
  }
  const HandOptions options = options_of(pose, forearm);
  const Body body = hand(options);
  const MeshReport report = inspect(body.mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_NEAR(body.mesh.vertices().row(1).minCoeff(), kHandEnd - forearm, 1 * kMm);
  // The grid that the skin is smoothed on has another origin.
  const Eigen::VectorXd change = hand_distances(options, plain.mesh.vertices()) - own_distances;
  for (Eigen::Index v = 0; v < change.size(); ++v) {
    if (plain.mesh.vertices()(1, v) > kHandEnd + 20 * kMm) {
      EXPECT_LT(std::abs(change(v)), 0.2 * kMm) << plain.mesh.vertices().col(v).transpose();
    }
  }
  for (const auto& [name, own] : own_landmarks) {
    EXPECT_LT((hand_landmark(options, name) - own).norm(), 0.05 * kMm) << name;
  }
}

TEST_P(ForearmPoses, IsSoundOnACoarseMesh) {
  const HandOptions options = options_of(GetParam().first, 250 * kMm);
  const Vector3 pad = hand_landmark(options, "index_pad");
  const TriangleMesh mesh = hand(options, EdgeSizing(12 * kMm, {{pad, 1.2 * kMm, 15 * kMm}})).mesh;
  EXPECT_THAT(inspect(mesh).faults, IsEmpty());
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
  EXPECT_LT(mesh.face_count(), 5500);
}

INSTANTIATE_TEST_SUITE_P(Small, ForearmPoses,
                         ::testing::Values(std::pair{"flat", 1 * kMm}, std::pair{"grasp", 300 * kMm}));
INSTANTIATE_TEST_SUITE_P(Full, ForearmPoses,
                         ::testing::Values(std::pair{"index_up", 60 * kMm}, std::pair{"point_down", 60 * kMm},
                                           std::pair{"fist", 300 * kMm}));

// However the joints are turned, from 5 mm behind the hand's own end on nothing moves.
TEST(Forearm, IsRigidWithThePalm) {
  const HandOptions options = options_of("flat", 200 * kMm, 8 * kMm);
  const auto skeleton = [&](const HandJoints& joints) {
    return posed_skeleton(hand_pose("flat", joints), options.length, options.breadth);
  };
  const Points rest = hand(options).mesh.vertices();
  const SkinnedHand skin(rest, skeleton({}));
  for (const HandJoint& joint : all_joints()) {
    for (const double angle : {joint.least, joint.most}) {
      HandJoints joints;
      joint.turn(joints, angle * kDegree);
      Points posed;
      skin.pose(skeleton(joints), posed);
      int behind = 0;
      for (Eigen::Index v = 0; v < rest.cols(); ++v) {
        if (rest(1, v) < kHandEnd - 5 * kMm) {
          EXPECT_LT((posed.col(v) - rest.col(v)).norm(), 1e-12) << joint.name;
          ++behind;
        }
      }
      EXPECT_GT(behind, 500);
    }
  }
}

}  // namespace touchfield::forearm_test
