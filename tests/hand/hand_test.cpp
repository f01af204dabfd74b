#include "sim/hand/hand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/units.h"
#include "sim/hand/hand_flesh.h"
#include "sim/hand/hand_pose.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "tests/support/hand_support.h"
#include "tests/support/testing.h"

namespace touchfield::hand_test {

constexpr double kMm = kMillimetre;
constexpr std::array<const char*, 5> kDigits = {"thumb", "index", "middle", "ring", "little"};

HandOptions options_for(const std::string& pose, double edge) {
  HandOptions options;
  options.pose = pose;
  options.edge = edge;
  return options;
}

/// A pose's hand, meshed once.
const Body& made_hand(const std::string& pose, double edge = 3 * kMm) {
  static std::map<std::pair<std::string, double>, Body> made;
  const auto key = std::pair(pose, edge);
  if (made.find(key) == made.end()) {
    made.emplace(key, hand(options_for(pose, edge)));
  }
  return made.at(key);
}

/// Of a left hand, as the flesh is.
HandSkeleton default_skeleton(const std::string& pose) {
  return posed_skeleton(hand_pose(pose), HandOptions().length, HandOptions().breadth);
}

/// The bones of made_hand().
HandSkeleton made_skeleton(const std::string& pose) { return right_hand(default_skeleton(pose)); }

const BoneChain& digit(const HandSkeleton& skeleton, std::size_t i) {
  return i == 0 ? skeleton.thumb : skeleton.fingers[i - 1];
}

Vector3 landmark(const Body& body, const std::string& name) { return position(body.mesh, find_landmark(body, name)); }

Vector3 normal_at(const Body& body, const std::string& name) {
  return body.mesh.normals().col(find_landmark(body, name).face);
}

int genus(const MeshReport& report) { return static_cast<int>(1 - (report.vertices - report.faces / 2) / 2); }

/// Mean of the widths, across and from back to palm, of the cut through a finger at a point of its bone, over that
/// which is expected.
double relative_thickness(const TriangleMesh& mesh, const BoneChain& finger, int bone, double t, double expected) {
  const Vector3 centre = finger.along(bone, t);
  const Vector3 along = finger.direction(bone);
  const Vector3 palmar = finger.palmar[static_cast<std::size_t>(bone)];
  const Vector3 across = along.cross(palmar);
  const double other_finger = 0.65 * expected;  // farther from the bone the skin may be a neighbour's
  std::array<double, 4> reach{};                // palmar, back, across both ways
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const Vector3 p = mesh.corner(f, c) - centre;
      const Vector3 q = mesh.corner(f, (c + 1) % 3) - centre;
      const double from = p.dot(along);
      const double to = q.dot(along);
      const Vector3 cut = p + (q - p) * (from / (from - to));
      if (from * to < 0 && cut.norm() < other_finger) {
        reach = {std::max(reach[0], cut.dot(palmar)), std::max(reach[1], -cut.dot(palmar)),
                 std::max(reach[2], cut.dot(across)), std::max(reach[3], -cut.dot(across))};
      }
    }
  }
  return 0.5 * (reach[0] + reach[1] + reach[2] + reach[3]) / expected;
}

void expect_sound(const TriangleMesh& mesh) {
  const MeshReport report = inspect(mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
}

class HandMesh : public ::testing::TestWithParam<std::pair<std::string, double>> {};

TEST_P(HandMesh, IsAUniformClosedSurface) {
  const auto& [pose, edge] = GetParam();
  const TriangleMesh& mesh = made_hand(pose, edge).mesh;
  expect_sound(mesh);
  const MeshReport report = inspect(mesh);
  EXPECT_EQ(report.unused_vertices, 0);
  // Genus 0, but for the pointing hands: the thumb and the fingers that it is laid over are one ring, genus 1.
  EXPECT_EQ(genus(report), pose == "index_up" || pose == "point_down" ? 1 : 0);
  EXPECT_NEAR(mesh.mean_edge() / edge, 1.0, edge < 2 * kMm ? 0.05 : 0.03);  // as the header promises
  EXPECT_GT(report.smallest_angle, 20 * kDegree);
  EXPECT_GT(edge_fit(mesh, EdgeSizing(edge)).share, 0.99);
}

INSTANTIATE_TEST_SUITE_P(Poses, HandMesh,
                         ::testing::Values(std::pair("flat", 3 * kMm), std::pair("index_up", 3 * kMm),
                                           std::pair("grasp", 3 * kMm), std::pair("point_down", 3 * kMm),
                                           std::pair("fist", 3 * kMm)));
INSTANTIATE_TEST_SUITE_P(Full, HandMesh, ::testing::Values(std::pair("index_up", 1.5 * kMm)));

// Even where neither edge nor breadth is of use: closed, one piece, no face through another.
TEST(Hand, HoldsAtTheEndsOfItsRanges) {
  for (const auto& [pose, breadth, length, edge] :
       {std::tuple{"index_up", 0.05, 0.26, 8 * kMm}, {"grasp", 0.15, 0.26, 8 * kMm}, {"flat", 0.05, 0.12, 8 * kMm}}) {
    HandOptions options = options_for(pose, edge);
    options.breadth = breadth;
    options.length = length;
    SCOPED_TRACE(pose);
    expect_sound(hand(options).mesh);
  }
}

// A whole hand has about 425 cm2 of skin and 340 cm3.
TEST(Hand, HasThePublishedAreaAndVolume) {
  const TriangleMesh& mesh = made_hand("flat").mesh;
  EXPECT_NEAR(mesh.total_area() / 425e-4, 1.0, 0.1);
  EXPECT_NEAR(mesh.signed_volume() / 340e-6, 1.0, 0.1);
}

// The vertices stand off the surface so that a coarse mesh encloses what a fine one does.
TEST(Hand, AreaAndVolumeDoNotDependOnTheEdge) {
  const TriangleMesh& fine = made_hand("flat", 2 * kMm).mesh;
  const TriangleMesh& coarse = made_hand("flat").mesh;
  EXPECT_NEAR(coarse.signed_volume() / fine.signed_volume(), 1.0, 0.005);
  EXPECT_NEAR(coarse.total_area() / fine.total_area(), 1.0, 0.005);
}

// Shares of the breadth in the middle of each segment; a joint has the mean of its two segments.
TEST(Hand, FingersHaveThePublishedThickness) {
  constexpr std::array<std::array<double, 3>, 4> kShares = {
      {{0.229, 0.198, 0.176}, {0.216, 0.197, 0.180}, {0.203, 0.182, 0.168}, {0.183, 0.165, 0.149}}};
  const double breadth = HandOptions().breadth;
  const TriangleMesh& mesh = made_hand("flat", 2 * kMm).mesh;
  const HandSkeleton skeleton = made_skeleton("flat");
  const auto expect_thick = [&](const BoneChain& chain, int bone, double t, double share) {
    EXPECT_NEAR(relative_thickness(mesh, chain, bone, t, share * breadth), 1.0, 0.1) << bone << " " << t;
  };
  for (std::size_t i = 0; i < 4; ++i) {
    SCOPED_TRACE(i);
    const auto& share = kShares[i];
    expect_thick(skeleton.fingers[i], 0, 0.75, share[0]);  // the middle lies in the web
    expect_thick(skeleton.fingers[i], 1, 0.5, share[1]);
    expect_thick(skeleton.fingers[i], 2, 0.5, share[2]);
    expect_thick(skeleton.fingers[i], 0, 0.99, 0.5 * (share[0] + share[1]));
    expect_thick(skeleton.fingers[i], 1, 0.99, 0.5 * (share[1] + share[2]));
  }
  expect_thick(skeleton.thumb, 1, 0.5, 0.229);
  expect_thick(skeleton.thumb, 1, 0.99, 0.5 * (0.229 + 0.212));
  expect_thick(skeleton.thumb, 2, 0.5, 0.212);
}

TEST(Hand, FlatHandHasItsLengthAndBreadth) {
  const Body& body = made_hand("flat");
  const double crease = -0.073 * 193.3 * kMm;
  EXPECT_NEAR(landmark(body, "middle_tip").y() - crease, 193.3 * kMm, 1.5 * kMm);  // fingers bend by some degrees
  EXPECT_NEAR(body.mesh.vertices().row(1).minCoeff(), -20 * kMm, 1 * kMm);
  // The breadth across the heads of the metacarpals: index at 72 mm from the wrist, little finger at 57 mm.
  double little_side = 0;
  double index_side = 0;
  for (const auto& x : body.mesh.vertices().colwise()) {
    if (std::abs(x.y() - 57 * kMm) < 5 * kMm) {
      little_side = std::max(little_side, x.x());
    }
    const bool thumb = x.x() < -50 * kMm;
    if (std::abs(x.y() - 74 * kMm) < 4 * kMm && !thumb) {
      index_side = std::min(index_side, x.x());
    }
  }
  EXPECT_NEAR(little_side - index_side, 88.3 * kMm, 0.03 * 88.3 * kMm);
}

// A digit's pad faces its palm side and its tip the end of its bone, wherever the pose leaves it free.
TEST(Hand, LandmarksLieOnTheirSkinAndFaceTheirWay) {
  const std::map<std::string, std::vector<std::size_t>> free_digits = {
      {"flat", {0, 1, 2, 3, 4}}, {"index_up", {1}}, {"grasp", {0, 1, 2, 3, 4}}, {"point_down", {1}}, {"fist", {}}};
  const double turned =
      std::cos(25 * kDegree);  // faces of 3 mm on a little finger 13 mm thick: 13 degrees; a pad's slope
  for (const auto& [pose, digits] : free_digits) {
    SCOPED_TRACE(pose);
    const Body& body = made_hand(pose);
    const HandSkeleton skeleton = made_skeleton(pose);
    for (const std::size_t i : digits) {
      const BoneChain& chain = digit(skeleton, i);
      const std::string name(kDigits[i]);
      EXPECT_GT(normal_at(body, name + "_pad").dot(chain.palmar[2]), turned) << name;
      EXPECT_GT(normal_at(body, name + "_tip").dot(chain.direction(2)), turned) << name;
      // Straight below the middle of the last bone, a radius away within 15 %.
      const Vector3 pad = landmark(body, name + "_pad") - chain.along(2, 0.5);
      const double radius = 0.5 * (chain.radii[2] + chain.radii[3]);
      EXPECT_NEAR(pad.dot(chain.palmar[2]), radius, 0.15 * radius) << name;
      EXPECT_LT((pad - pad.dot(chain.palmar[2]) * chain.palmar[2]).norm(), 0.7 * kMm) << name;
      EXPECT_LT((landmark(body, name + "_tip") - chain.joints[3]).norm(), 0.6 * kMm) << name;
    }
    EXPECT_LT(normal_at(body, "wrist").z(), -0.9);
    EXPECT_NEAR(landmark(body, "wrist").y(), 0, 0.3 * kMm);
    EXPECT_GT(normal_at(body, "back_centre").z(), 0.9);
    EXPECT_LT(normal_at(body, "palm_centre").z(), pose == "flat" ? -0.9 : 0.0);  // else the thumb's ball slopes
  }
}

TEST(Hand, LandmarksAreWhereTheMeshHasThem) {
  for (const std::string& pose : hand_poses()) {
    const HandSkeleton skeleton = default_skeleton(pose);
    const SoftBody flesh = hand_flesh(skeleton);
    for (const std::string& name : hand_landmark_names()) {
      const Vector3 at = landmark_on_skin(skeleton, flesh, name);
      EXPECT_NEAR(flesh.distance(at), 0, 1e-6) << pose << " " << name;
      EXPECT_LT((mirrored(at) - landmark(made_hand(pose), name)).norm(), 0.5 * kMm) << pose << " " << name;
    }
  }
}

TEST(Hand, LandmarkWithoutAMeshMirrorsAndKnowsItsNames) {
  HandOptions options = options_for("point_down", 3 * kMm);
  const Vector3 right = hand_landmark(options, "index_pad");
  options.side = HandSide::kLeft;
  const Vector3 left = hand_landmark(options, "index_pad");
  EXPECT_EQ(left, Vector3(-right.x(), right.y(), right.z()));
  EXPECT_THAT([&] { hand_landmark(options, "index_nail"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("'index_nail'"), HasSubstr("thumb_pad, index_pad"),
                                              HasSubstr("palm_centre, back_centre, wrist"))));
}

// Of one's own right hand, palm down and fingers away, the thumb is on the left: from it to the other fingers one turns
// about the way that the palm faces. A thumb that is laid over curled fingers reaches across the middle one.
TEST(Hand, RightAndLeftAreTheHandsOfThatName) {
  for (const std::string& pose : hand_poses()) {
    for (const HandSide side : {HandSide::kRight, HandSide::kLeft}) {
      SCOPED_TRACE(pose + (side == HandSide::kRight ? " right" : " left"));
      HandOptions options = options_for(pose, 6 * kMm);
      options.side = side;
      const double sign = side == HandSide::kRight ? 1.0 : -1.0;
      const auto at = [&](const std::string& name) { return hand_landmark(options, name); };
      const auto turn = [&](const std::string& one, const std::string& other) {
        const Vector3 wrist = at("wrist");
        return sign * Vector3(at(one) - wrist).cross(at(other) - wrist).dot(at("palm_centre") - at("back_centre"));
      };
      for (std::size_t i = 1; i + 1 < kDigits.size(); ++i) {
        const std::string one = std::string(kDigits[i]) + "_pad";
        const std::string next = std::string(kDigits[i + 1]) + "_pad";
        EXPECT_GT(turn(one, next), 0) << one;
        EXPECT_GT(sign * (at(next) - at(one)).x(), 5 * kMm) << one;
      }
      if (pose == "flat" || pose == "grasp") {
        EXPECT_GT(turn("thumb_tip", "middle_tip"), 0);
        EXPECT_LT(sign * at("thumb_tip").x(), -20 * kMm);
      }
    }
  }
}

TEST(Hand, LeftIsTheMirrorImageOfRight) {
  HandOptions options = options_for("index_up", 6 * kMm);
  const Body right = hand(options);
  options.side = HandSide::kLeft;
  const Body left = hand(options);
  EXPECT_THAT(inspect(left.mesh).faults, IsEmpty());
  const Eigen::DiagonalMatrix<double, 3> mirror(-1, 1, 1);
  EXPECT_LT((left.mesh.centroids() - mirror * right.mesh.centroids()).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((left.mesh.normals() - mirror * right.mesh.normals()).cwiseAbs().maxCoeff(), 1e-12);
  for (std::size_t i = 0; i < right.landmarks.size(); ++i) {
    EXPECT_EQ(left.landmarks[i].name, right.landmarks[i].name);
    EXPECT_LT((position(left.mesh, left.landmarks[i]) - mirror * position(right.mesh, right.landmarks[i])).norm(),
              1e-15);
  }
}

TEST(Hand, DistancesAreFromTheSkinOfEitherSide) {
  HandOptions options = options_for("index_up", 2 * kMm);
  for (const HandSide side : {HandSide::kRight, HandSide::kLeft}) {
    options.side = side;
    const Body body = hand(options);
    const Points& vertices = body.mesh.vertices();
    EXPECT_LT(hand_distances(options, vertices).cwiseAbs().maxCoeff(), 0.2 * kMm);  // as the header says
    const Vector3 pad = position(body.mesh, find_landmark(body, "index_pad"));
    for (const double off : {-2.0, 0.5, 2.0}) {
      const Points moved = body.mesh.centroids() + off * kMm * body.mesh.normals();
      const Eigen::VectorXd distances = hand_distances(options, moved);
      for (Eigen::Index f = 0; f < body.mesh.face_count(); ++f) {
        if ((body.mesh.centroids().col(f) - pad).norm() < 12 * kMm) {  // where nothing else of the hand is near
          EXPECT_NEAR(distances(f), off * kMm, 0.2 * kMm);
        }
      }
    }
  }
}

TEST(Hand, LengthAndBreadthScaleTheirOwnDirections) {
  HandOptions options = options_for("flat", 3 * kMm);
  const Vector3 tip = hand_landmark(options, "middle_tip");
  const Vector3 pad = hand_landmark(options, "index_pad");
  options.length *= 1.1;
  EXPECT_NEAR(hand_landmark(options, "middle_tip").y() / tip.y(), 1.1, 0.002);  // the skin's smoothing does not scale
  options.breadth *= 1.1;  // now 1.1 times as large in all but the stub behind the wrist
  EXPECT_LT((hand_landmark(options, "index_pad") - 1.1 * pad).norm(), 0.2 * kMm);
}

TEST(Hand, RefusesWhatIsNoHand) {
  const std::vector<std::pair<std::function<void(HandOptions&)>, std::string>> cases = {
      {[](HandOptions& o) { o.pose = "wave"; }, "flat, index_up, grasp, point_down, fist"},
      {[](HandOptions& o) { o.breadth = 0.2; }, "hand.breadth = 0.2 m must be 0.05 to 0.15 m"},
      {[](HandOptions& o) { o.length = 0.1; }, "hand.length"},
      {[](HandOptions& o) { o.forearm = 0.31; }, "hand.forearm = 0.31 m must be 0 to 0.3 m"},
      {[](HandOptions& o) { o.edge = 13e-3; }, "hand.edge"}};
  for (const auto& [change, phrase] : cases) {
    HandOptions options;
    change(options);
    EXPECT_THAT([&] { hand(options); }, ThrowsMessage<InputError>(HasSubstr(phrase)));
  }
  EXPECT_THROW(hand_landmark(options_for("wave", 3e-3), "index_pad"), InputError);
}

/// Graded about the index pad, edges in mm.
TriangleMesh meshed(const HandOptions& options, double near, double far) {
  const Vector3 pad = hand_landmark(options, "index_pad");
  return hand(options, EdgeSizing(far * kMm, {{pad, near * kMm, 15 * kMm}})).mesh;
}

/// Greatest distance of the vertices of one mesh from another [m].
double greatest_distance(const TriangleMesh& from, const TriangleMesh& to) {
  const FaceTree tree(to);
  double most = 0;
  for (const auto& x : from.vertices().colwise()) {
    most = std::max(most, tree.nearest(x).distance);
  }
  return most;
}

/// A pose, and whether every grading and size is tried.
class CoarseHand : public ::testing::TestWithParam<std::tuple<const char*, bool>> {};

// Measured against edges of 1.2 mm: volume -0.9 to 0.05 %, skin within 5.5 mm; without the bounds of skin_mesh 27 mm.
TEST_P(CoarseHand, KeepsItsShape) {
  const auto [pose, all] = GetParam();
  const HandOptions options = options_for(pose, 12 * kMm);
  const double finest = all ? 1.2 : 2.4;
  const TriangleMesh fine = meshed(options, finest, finest);
  std::vector<std::tuple<double, double, int>> gradings = {{1.2, 6.5, 5200}, {12, 12, 1250}};
  if (all) {
    gradings.insert(gradings.end(), {{2.4, 8, 2500}, {0.8, 12, 6500}, {2.4, 12, 2000}});
  }
  for (const auto& [near, far, faces] : gradings) {
    SCOPED_TRACE(testing::Message() << "near " << near << " far " << far);
    const TriangleMesh mesh = meshed(options, near, far);
    expect_sound(mesh);
    EXPECT_LT(mesh.face_count(), faces);
    EXPECT_NEAR(mesh.signed_volume() / fine.signed_volume(), 1.0, 0.012);
    EXPECT_LT(greatest_distance(fine, mesh), 6.5 * kMm);
    EXPECT_LT(greatest_distance(mesh, fine), 0.1 * far * kMm + 0.1 * kMm);  // as the vertices stand off
  }
}

INSTANTIATE_TEST_SUITE_P(Poses, CoarseHand,
                         ::testing::Combine(::testing::Values("index_up", "grasp"), ::testing::Values(false)));
INSTANTIATE_TEST_SUITE_P(Full, CoarseHand,
                         ::testing::Combine(::testing::Values("flat", "index_up", "grasp", "point_down", "fist"),
                                            ::testing::Values(true)));

// Faces of 8 mm cut each other between the fingers of grasp, and so they did before edges were shortened there.
TEST(CoarseHand, MeshesAgainWhereTheSkinCutsItself) { expect_sound(hand(options_for("grasp", 8 * kMm)).mesh); }

constexpr double kHandEnd = -20 * kMm;  // y

HandOptions options_of(const std::string& pose, double forearm, double edge = 5 * kMm) {
  HandOptions options = options_for(pose, edge);
  options.forearm = forearm;
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
  expect_sound(body.mesh);
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
  expect_sound(mesh);
  EXPECT_LT(mesh.face_count(), 5500);
}

INSTANTIATE_TEST_SUITE_P(Small, ForearmPoses, ::testing::Values(std::pair{"grasp", 300 * kMm}));
INSTANTIATE_TEST_SUITE_P(Full, ForearmPoses,
                         ::testing::Values(std::pair{"flat", 1 * kMm}, std::pair{"index_up", 60 * kMm},
                                           std::pair{"point_down", 60 * kMm}, std::pair{"fist", 300 * kMm}));

/// Of a right hand.
HandSkeleton skeleton_of(const HandOptions& options) {
  return right_hand(posed_skeleton(hand_pose(options.pose, options.joints), options.length, options.breadth));
}

// The finger is turned about its knuckle as a whole.
TEST(HandJoints, TurnTheFingerAboutItsJoint) {
  HandOptions options = options_for("flat", 3 * kMm);
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
}

// The metacarpal's direction as the header has it; and the skin follows the bones.
TEST(HandJoints, TurnTheThumb) {
  HandOptions options = options_for("flat", 3 * kMm);
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

// Angles drawn without any regard to each other: parts of the hand lie across and within each other.
TEST(HandJoints, AnyAnglesGiveASoundSkinOrAClearError) {
  constexpr int kDraws = 3;
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
      expect_sound(body.mesh);
      EXPECT_GT(body.mesh.signed_volume(), 250e-6) << draw;  // of 340 cm3 spread out
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

}  // namespace touchfield::hand_test
