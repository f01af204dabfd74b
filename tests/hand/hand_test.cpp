#include "sim/hand/hand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

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

HandSkeleton skeleton_of(const HandOptions& options) {
  return posed_skeleton(hand_pose(options.pose, options.joints), options.length, options.breadth);
}

/// Of a left hand, as the flesh is.
HandSkeleton default_skeleton(const std::string& pose) { return skeleton_of(options_for(pose, 3 * kMm)); }

/// The bones of made_hand().
HandSkeleton made_skeleton(const std::string& pose) { return right_hand(default_skeleton(pose)); }

const SoftBody& default_flesh(const std::string& pose) {
  static std::map<std::string, SoftBody> made;
  if (made.find(pose) == made.end()) {
    made.emplace(pose, hand_flesh(default_skeleton(pose)));
  }
  return made.at(pose);
}

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

class HandMesh : public ::testing::TestWithParam<std::pair<std::string, double>> {};

TEST_P(HandMesh, IsAUniformClosedSurface) {
  const auto& [pose, edge] = GetParam();
  const TriangleMesh& mesh = made_hand(pose, edge).mesh;
  const MeshReport report = inspect(mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.unused_vertices, 0);
  // Genus 0, but for the pointing hands: the thumb and the fingers that it is laid over are one ring, genus 1.
  EXPECT_EQ(genus(report), pose == "index_up" || pose == "point_down" ? 1 : 0);
  EXPECT_NEAR(mesh.mean_edge() / edge, 1.0, edge < 2 * kMm ? 0.05 : 0.03);  // as the header promises
  EXPECT_GT(report.smallest_angle, 20 * kDegree);
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
  EXPECT_GT(edge_fit(mesh, EdgeSizing(edge)).share, 0.99);
}

INSTANTIATE_TEST_SUITE_P(Poses, HandMesh,
                         ::testing::Values(std::pair("flat", 3 * kMm), std::pair("index_up", 3 * kMm),
                                           std::pair("grasp", 3 * kMm), std::pair("point_down", 3 * kMm),
                                           std::pair("fist", 3 * kMm)));
INSTANTIATE_TEST_SUITE_P(Full, HandMesh, ::testing::Values(std::pair("index_up", 1.5 * kMm)));

// Even where neither edge nor breadth is of use: closed, one piece, no face through another.
TEST(Hand, HoldsAtTheEndsOfItsRanges) {
  for (const auto& [pose, breadth, length, edge] : {std::tuple{"index_up", 0.05, 0.26, 6 * kMm},
                                                    {"grasp", 0.15, 0.26, 8 * kMm},
                                                    {"flat", 0.05, 0.12, 8 * kMm},
                                                    {"fist", 0.072, 0.165, 12 * kMm}}) {
    HandOptions options = options_for(pose, edge);
    options.breadth = breadth;
    options.length = length;
    const TriangleMesh mesh = hand(options).mesh;
    EXPECT_THAT(inspect(mesh).faults, IsEmpty()) << pose << " " << breadth << " " << length;
    EXPECT_EQ(inspect(mesh).components, 1);
    EXPECT_THAT(self_intersections(mesh), IsEmpty()) << pose << " " << breadth << " " << length;
  }
}

// A whole hand has about 425 cm2 of skin and 340 cm3.
TEST(Hand, HasThePublishedAreaAndVolume) {
  const TriangleMesh& mesh = made_hand("flat").mesh;
  EXPECT_NEAR(mesh.total_area() / 425e-4, 1.0, 0.1);
  EXPECT_NEAR(mesh.signed_volume() / 340e-6, 1.0, 0.1);
}

// The vertices stand off the surface so that a coarse mesh encloses what a fine one does. With the vertices on the
// surface 3 mm edges would lose 1 to 2 % against 1.5 mm.
TEST(Hand, AreaAndVolumeDoNotDependOnTheEdge) {
  const TriangleMesh& fine = made_hand("flat", 1.5 * kMm).mesh;
  const TriangleMesh& coarse = made_hand("flat").mesh;
  EXPECT_NEAR(coarse.signed_volume() / fine.signed_volume(), 1.0, 0.005);
  EXPECT_NEAR(coarse.total_area() / fine.total_area(), 1.0, 0.005);
}

// Shares of the breadth in the middle of each segment; a joint has the mean of its two segments.
TEST(Hand, FingersHaveThePublishedThickness) {
  constexpr std::array<std::array<double, 3>, 4> kShares = {
      {{0.229, 0.198, 0.176}, {0.216, 0.197, 0.180}, {0.203, 0.182, 0.168}, {0.183, 0.165, 0.149}}};
  const double breadth = HandOptions().breadth;
  const TriangleMesh& mesh = made_hand("flat", 1.5 * kMm).mesh;
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

// A box of 55 mm: the fingers' pads lie in one face, the thumb's in the opposite one, all facing the box.
TEST(Hand, GraspHoldsABox) {
  const HandSkeleton skeleton = made_skeleton("grasp");
  const Body& body = made_hand("grasp");
  Vector3 facing = -skeleton.thumb.palmar[2];
  for (const BoneChain& finger : skeleton.fingers) {
    facing += 0.25 * finger.palmar[2];
  }
  facing.normalize();
  const Vector3 thumb = landmark(body, "thumb_pad");
  EXPECT_GT(normal_at(body, "thumb_pad").dot(-facing), std::cos(20 * kDegree));
  for (const char* name : {"index_pad", "middle_pad", "ring_pad", "little_pad"}) {
    EXPECT_NEAR((thumb - landmark(body, name)).dot(facing), 55 * kMm, 3 * kMm) << name;
    EXPECT_GT(normal_at(body, name).dot(facing), std::cos(20 * kDegree)) << name;
  }
  // The thumb stands opposite to index and middle finger.
  const Vector3 between = 0.5 * (landmark(body, "index_pad") + landmark(body, "middle_pad"));
  const Vector3 aside = thumb - between - (thumb - between).dot(facing) * facing;
  EXPECT_LT(aside.norm(), 15 * kMm);
}

TEST(Hand, LandmarksAreWhereTheMeshHasThem) {
  for (const std::string& pose : hand_poses()) {
    const HandSkeleton skeleton = default_skeleton(pose);
    const SoftBody& flesh = default_flesh(pose);
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
      {[](HandOptions& o) { o.breadth = std::nan(""); }, "hand.breadth"},
      {[](HandOptions& o) { o.length = 0.1; }, "hand.length"},
      {[](HandOptions& o) { o.forearm = 0.31; }, "hand.forearm = 0.31 m must be 0 to 0.3 m"},
      {[](HandOptions& o) { o.forearm = -1e-3; }, "hand.forearm"},
      {[](HandOptions& o) { o.edge = 0.2e-3; }, "hand.edge"},
      {[](HandOptions& o) { o.edge = 13e-3; }, "hand.edge"}};
  for (const auto& [change, phrase] : cases) {
    HandOptions options;
    change(options);
    EXPECT_THAT([&] { hand(options); }, ThrowsMessage<InputError>(HasSubstr(phrase)));
  }
  EXPECT_THROW(hand(HandOptions(), EdgeSizing(3e-3, {{Vector3::Zero(), 0.2e-3, 1e-3}})), InputError);
  EXPECT_THROW(hand_landmark(options_for("wave", 3e-3), "index_pad"), InputError);
}

/// Graded about the index pad; near 0: uniform.
struct Edges {
  double near_mm;
  double far_mm;
};

TriangleMesh meshed(const HandOptions& options, const Edges& edges) {
  if (edges.near_mm == 0) {
    return hand(options, EdgeSizing(edges.far_mm * kMm)).mesh;
  }
  const Vector3 pad = hand_landmark(options, "index_pad");
  return hand(options, EdgeSizing(edges.far_mm * kMm, {{pad, edges.near_mm * kMm, 15 * kMm}})).mesh;
}

void expect_sound(const TriangleMesh& mesh) {
  const MeshReport report = inspect(mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
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
  const TriangleMesh fine = meshed(options, {0, all ? 1.2 : 2.4});
  std::vector<std::pair<Edges, int>> gradings = {{{1.2, 6.5}, 5200}, {{0, 12}, 1250}};
  if (all) {
    gradings.insert(gradings.end(), {{{2.4, 8}, 2500}, {{0.8, 12}, 6500}, {{2.4, 12}, 2000}});
  }
  for (const auto& [edges, faces] : gradings) {
    SCOPED_TRACE(testing::Message() << "near " << edges.near_mm << " far " << edges.far_mm);
    const TriangleMesh mesh = meshed(options, edges);
    expect_sound(mesh);
    EXPECT_LT(mesh.face_count(), faces);
    EXPECT_NEAR(mesh.signed_volume() / fine.signed_volume(), 1.0, 0.012);
    EXPECT_LT(greatest_distance(fine, mesh), 6.5 * kMm);
    EXPECT_LT(greatest_distance(mesh, fine), 0.1 * edges.far_mm * kMm + 0.1 * kMm);  // as the vertices stand off
  }
}

INSTANTIATE_TEST_SUITE_P(Poses, CoarseHand,
                         ::testing::Combine(::testing::Values("index_up", "grasp"), ::testing::Values(false)));
INSTANTIATE_TEST_SUITE_P(Full, CoarseHand,
                         ::testing::Combine(::testing::Values("flat", "index_up", "grasp", "point_down", "fist"),
                                            ::testing::Values(true)));

// Faces of 8 mm cut each other between the fingers of grasp, and so they did before edges were shortened there.
TEST(CoarseHand, MeshesAgainWhereTheSkinCutsItself) { expect_sound(hand(options_for("grasp", 8 * kMm)).mesh); }

}  // namespace touchfield::hand_test
