#include "sim/cameras/hand_search.h"

#include <random>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "tests/support/mesh_support.h"
#include "tests/support/sight_support.h"
#include "tests/support/testing.h"

namespace touchfield::hand_search_test {

const Vector3 kOver(0, 0, 0.25);  // the middle of what the cameras look at
const Vector3 kPalm(0, 0.06, 0);  // about the middle of a hand in its own frame
const Box kWorkspace(kOver - Vector3::Constant(0.2), kOver + Vector3::Constant(0.2));

const HandSearch& search() {
  static const HandSearch kSearch({hand({.edge = 5e-3}).mesh});
  return kSearch;
}

/// A smaller hand than the one looked for, its index finger bent.
const TriangleMesh& searched_hand() {
  static const TriangleMesh kHand = [] {
    HandOptions options;
    options.breadth = 80e-3;
    options.length = 180e-3;
    options.edge = 3e-3;
    options.joints.index.mcp = 20 * kDegree;
    options.joints.index.pip = 20 * kDegree;
    return hand(options).mesh;
  }();
  return kHand;
}

std::vector<HandStart> starts_of(const TriangleMesh& scene, const std::vector<DepthCamera>& cameras) {
  DepthFrame frame = exact_frame(cameras, scene);
  add_stereo_noise(frame, cameras, 1);
  return search().starts(PointReader(cameras).read(frame, kWorkspace), cameras, frame, 6, {0});
}

/// How many starts come before the first that is within 25 degrees and 20 mm.
std::ptrdiff_t rank_of(const RigidMotion& place, const std::vector<HandStart>& starts) {
  return std::ranges::find_if(starts,
                              [&](const HandStart& start) {
                                const Eigen::Matrix3d turn = start.place.rotation.transpose() * place.rotation;
                                return (start.place(kPalm) - place(kPalm)).norm() < 20e-3 &&
                                       Eigen::AngleAxisd(turn).angle() < 25 * kDegree;
                              }) -
         starts.begin();
}

RigidMotion some_place(std::mt19937& random) {
  const Eigen::Matrix3d turn = some_rotation(random);
  return {turn, kOver + 0.03 * point_in_cube(random) - turn * kPalm};
}

TEST(HandSearch, FindsAHandOfAnotherSizeAnyWayRound) {
  const std::vector<DepthCamera> cameras = cameras_round(kOver, 0.2, 0.25, 3);
  std::mt19937 random(1);
  for (int trial = 0; trial < 3; ++trial) {
    const RigidMotion place = some_place(random);
    const std::vector<HandStart> starts = starts_of(transformed(searched_hand(), place.rotation, place.shift), cameras);
    EXPECT_LT(rank_of(place, starts), 2) << trial;
    EXPECT_LE(starts.size(), 6U);
    EXPECT_TRUE(std::ranges::is_sorted(starts, {}, &HandStart::cost));
  }
}

TEST(HandSearch, IsNotMisledByASleeveAndAnotherThing) {
  const std::vector<DepthCamera> cameras = cameras_round(kOver, 0.2, 0.25, 3);
  const TriangleMesh sleeved = together(searched_hand(), shifted(capsule(35e-3, 0.2, 6e-3).mesh, Vector3(0, -0.14, 0)));
  const TriangleMesh thing = shifted(box({0.08, 0.06, 0.05}, 0.02).mesh, kOver + Vector3(0.15, 0.12, 0));
  std::mt19937 random(2);
  for (int trial = 0; trial < 3; ++trial) {
    const RigidMotion place = some_place(random);
    const std::vector<HandStart> starts =
        starts_of(together(transformed(sleeved, place.rotation, place.shift), thing), cameras);
    EXPECT_LT(rank_of(place, starts), 6) << trial;
  }
}

TEST(HandSearch, FindsThePalmThatOneCameraSees) {
  const std::vector<DepthCamera> cameras{depth_camera(kOver - Vector3(0, 0, 0.35), kOver, Vector3::UnitY())};
  std::mt19937 random(3);
  for (int trial = 0; trial < 2; ++trial) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(uniform(random, 0, 6), Vector3::UnitZ()) *
                                 Eigen::AngleAxisd(uniform(random, -0.4, 0.4), Vector3::UnitX()).toRotationMatrix();
    const RigidMotion place{turn, kOver - turn * kPalm};
    const std::vector<HandStart> starts = starts_of(transformed(searched_hand(), place.rotation, place.shift), cameras);
    EXPECT_LT(rank_of(place, starts), 6) << trial;
  }
}

TEST(HandSearch, FindsNoHandInNothing) {
  const std::vector<DepthCamera> cameras = cameras_round(kOver, 0.2, 0.25, 2);
  DepthFrame frame;
  frame.images.assign(2, {640, 360, std::vector<float>(640 * 360, 0.0F)});
  EXPECT_TRUE(search().starts({}, cameras, frame, 6, {0}).empty());
  EXPECT_TRUE(starts_of(shifted(icosphere(8e-3, 8), kOver), cameras).empty());
  frame.images.pop_back();
  EXPECT_THAT(message_of<InputError>([&] { search().starts({}, cameras, frame, 6, {0}); }),
              HasSubstr("1 depth images of 2"));
  EXPECT_THAT(message_of<InputError>([&] { HandSearch({}); }), HasSubstr("no skin"));
}

}  // namespace touchfield::hand_search_test
