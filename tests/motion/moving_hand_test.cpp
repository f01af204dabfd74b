#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/moving_model.h"
#include "tests/support/moving_support.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::moving_hand_test {

/// The tip of a finger that bends.
const std::string kBendingFinger =
    "name: bending\n"
    "array: {grid: {count: [12, 10], pitch_mm: 10.16}}\n"
    "body:\n"
    "  hand: {pose: index_up}\n"
    "  place: {landmark: index_pad, at_mm: [0, 0, 120]}\n"
    "  edge_mm: {near_target: 2.5, far: 5, within_mm: 8}\n"
    "  keep_within_mm: 35\n"
    "target: {box: {at: index_pad, size_mm: [7, 7, 6]}, pressure_pa: 1500}\n"
    "solve: {methods: [surface], scheme: chief}\n"
    "evaluation: {scheme: chief, edge_mm: {near_target: 1.8, far: 4, within_mm: 8}}\n"
    "motion:\n"
    "  seconds: 0.5\n"
    "  solve_ms: 20\n"
    "  change: [{path: body.hand.joints.index.dip_deg, keys: [[0, 0], [0.5, 30]]}]\n";

const MovingModel& bending() {
  static const MovingModel kMoving(scene_from(kBendingFinger));
  return kMoving;
}

TEST(MovingHand, ThePadStaysInItsPlaceWhileTheFingerBends) {
  const MovingModel& moving = bending();
  EXPECT_FALSE(moving.is_rigid());
  const Model straight = moving.at(moving.state(0.0));
  const Model bent = moving.at(moving.state(0.5));
  EXPECT_EQ(straight.body.mesh.triangles(), bent.body.mesh.triangles());
  EXPECT_GT((straight.body.mesh.vertices() - bent.body.mesh.vertices()).colwise().norm().maxCoeff(), 3 * kMillimetre);
  const Landmark& pad = find_landmark(bent.body, "index_pad");
  // The anchor lies on the implicit skin, the landmark on the mesh.
  EXPECT_LT((position(bent.body.mesh, pad) - Vector3(0, 0, 0.12)).norm(), 0.6 * kMillimetre);
  EXPECT_LT((moving.patch(bent) - position(bent.body.mesh, pad)).norm(), 1e-12);
  EXPECT_NEAR(bent.body.mesh.signed_volume() / straight.body.mesh.signed_volume(), 1.0, 0.03);
}

TEST(MovingHand, EvaluationAndSolverSeeTheSameSkin) {
  const MovingModel moving(scene_from(kBendingFinger, {"body.keep_within_mm=null"}));
  for (const double seconds : {0.0, 0.25, 0.5}) {
    const MotionState state = moving.state(seconds);
    const Model model = moving.at(state);
    const auto evaluation = moving.evaluation_mesh(model, state);
    ASSERT_TRUE(evaluation);
    // Along each axis the two meshes reach as far, to what a coarse mesh cuts off.
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(evaluation->vertices().row(axis).minCoeff(), model.body.mesh.vertices().row(axis).minCoeff(), 1e-3);
      EXPECT_NEAR(evaluation->vertices().row(axis).maxCoeff(), model.body.mesh.vertices().row(axis).maxCoeff(), 1e-3);
    }
    EXPECT_TRUE(presses(model, *evaluation));
  }
}

TEST(MovingHand, SkinBeyondMovesWithTheHand) {
  const MovingModel moving(
      scene_from(kBendingFinger, {"motion.change=[{path: body.hand.joints.index.mcp_deg, keys: [[0, 0], [0.5, 20]]}, "
                                  "{path: 'body.place.at_mm[0]', rate: 20}]"}));
  const Model begin = moving.at(moving.state(0.0));
  EXPECT_EQ(begin.beyond.size(), moving.first().beyond.size());
  EXPECT_LT((begin.beyond.corners - moving.first().beyond.corners).cwiseAbs().maxCoeff(), 1e-9);
  const MotionState state = moving.state(0.5);
  const Model end = moving.at(state);
  EXPECT_EQ(end.beyond.areas, begin.beyond.areas);
  // The evaluation mesh has the whole hand, finer than the mesh that the patches lie on: chords of 5 mm on a radius of
  // 8 are 0.4 mm off.
  const FaceTree skin(*moving.evaluation_mesh(end, state));
  const Points centres = end.beyond.centres();
  double farthest = 0;
  for (const auto& x : centres.colwise()) farthest = std::max(farthest, skin.nearest(x).distance);
  EXPECT_LT(farthest, 1.2 * kMillimetre);
  EXPECT_GT((centres - begin.beyond.centres()).colwise().norm().maxCoeff(), 12 * kMillimetre);
  EXPECT_GT((centres - begin.beyond.centres()).colwise().norm().minCoeff(), 3 * kMillimetre);
}

TEST(MovingHand, FingersThatComeIntoContactAreNamedWithTheTime) {
  const std::string message = message_of<InputError>([] {
    MovingModel(scene_from(kBendingFinger, {"body.hand.pose=flat",
                                            "motion.change=[{path: body.hand.joints.index.abduction_deg, "
                                            "keys: [[0, 0], [0.5, -15]]}]"}));
  });
  EXPECT_THAT(message, HasSubstr("motion: at 0."));
  EXPECT_THAT(message, HasSubstr("index finger"));
  EXPECT_THAT(message, HasSubstr("middle finger"));
}

TEST(FrameBudget, TakesTheQuickestForNoTimeAndTheNearestForMuch) {
  const auto choice = [](double milliseconds) {
    return choose_frame(scene_from(kMovingCapsule, {"motion.frame={budget_ms: " + std::to_string(milliseconds) + "}"}));
  };
  const FrameChoice quickest = choice(0.01);
  EXPECT_EQ(quickest.setting.steps, 1);
  EXPECT_EQ(quickest.setting.near_target, 3e-3);
  EXPECT_GT(quickest.milliseconds, 0.01);
  const FrameChoice nearest = choice(60'000);
  EXPECT_EQ(nearest.setting.scheme, Scheme::kBurtonMillerPolished);
  EXPECT_EQ(nearest.setting.near_target, 1.7e-3);
  EXPECT_LT(nearest.milliseconds, 60'000);
}

TEST(WholeSkin, IsTheHandThatTheSolverSeesAPartOf) {
  const MovingModel moving(
      scene_from(kBendingFinger, {"evaluation=same",
                                  "motion.change=[{path: 'body.place.at_mm[0]', rate: 40}, "
                                  "{path: body.hand.joints.index.dip_deg, keys: [[0, 0], [0.5, 30]]}]"}));
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

}  // namespace touchfield::moving_hand_test
