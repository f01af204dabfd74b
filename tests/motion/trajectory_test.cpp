#include <numbers>
#include <random>

#include "sim/core/units.h"
#include "sim/motion/moving_model.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::trajectory_test {

const std::string kHand =
    "name: moving\n"
    "array: {grid: {}}\n"
    "body:\n"
    "  hand: {pose: index_up, joints: {middle: {mcp_deg: 33}}}\n"
    "  place: {landmark: index_pad, at_mm: [0.1, 0.2, 200.3], rotate_deg: [0, 10, 0]}\n"
    "  edge_mm: 3\n"
    "target: {box: {at: index_pad, offset_mm: [1, 0, 0], size_mm: [8, 40, 6]}, pressure_pa: 2000}\n"
    "solve: {methods: [surface]}\n"
    "motion: {seconds: 2}\n";

Scene moving(const std::vector<MotionChange>& changes, const std::vector<std::string>& overrides = {}) {
  Scene scene = scene_from(kHand, overrides);
  scene.motion->changes = changes;
  return scene;
}

MotionCurve through(const std::vector<std::array<double, 2>>& keys) { return {KeysLaw{keys}, 0.0}; }

TEST(MotionCurve, MeetsItsKeysAndStaysBeyondThem) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> value(-1, 1);
  for (int round = 0; round < 200; ++round) {
    std::vector<std::array<double, 2>> keys;
    double time = value(random);
    for (int i = 0; i < 1 + round % 9; ++i) keys.push_back({time += 1.001 + value(random), value(random)});
    const MotionCurve curve = through(keys);
    for (const auto& [t, v] : keys) EXPECT_EQ(curve(t), v);
    EXPECT_EQ(curve(keys.front()[0] - 0.1), keys.front()[1]);
    EXPECT_EQ(curve(keys.back()[0] + 0.1), keys.back()[1]);
  }
}

// Between two keys it neither leaves their values nor turns back.
TEST(MotionCurve, IsMonotoneBetweenKeys) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> value(0, 1);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::array<double, 2>> keys;
    double time = 0;
    for (int i = 0; i < 8; ++i) {
      keys.push_back({time, i > 0 && value(random) < 0.2 ? keys.back()[1] : std::pow(value(random), 6)});
      time += 0.01 + value(random);
    }
    const MotionCurve curve = through(keys);
    for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
      const double sign = keys[i + 1][1] >= keys[i][1] ? 1 : -1;
      double before = keys[i][1];
      for (int s = 1; s <= 200; ++s) {
        const double now = curve(std::min(keys[i + 1][0], keys[i][0] + (keys[i + 1][0] - keys[i][0]) * s / 200));
        EXPECT_GE(sign * (now - before), -1e-15);
        EXPECT_LE(sign * (now - keys[i + 1][1]), 0);
        before = now;
      }
    }
  }
}

TEST(MotionCurve, HasASteadySlopeAtItsKeys) {
  const MotionCurve curve = through({{0, 0}, {0.3, 1}, {1, 1.5}, {1.2, 4}});
  for (const double key : {0.3, 1.0}) {
    const double h = 1e-6;
    EXPECT_NEAR((curve(key) - curve(key - h)) / h, (curve(key + h) - curve(key)) / h, 1e-4);
  }
}

// Third order: the harmonic mean's slopes are right to second order.
TEST(MotionCurve, ConvergesOnASmoothMonotoneFunction) {
  const auto error = [](int count) {
    std::vector<std::array<double, 2>> keys;
    for (int i = 0; i <= count; ++i) keys.push_back({1.0 * i / count, std::exp(1.0 * i / count)});
    const MotionCurve curve = through(keys);
    double most = 0;
    for (int i = 0; i <= 20'000; ++i) most = std::max(most, std::abs(curve(i / 2e4) - std::exp(i / 2e4)));
    return most;
  };
  for (const int count : {8, 16, 32, 64}) {
    const double order = std::log2(error(count) / error(2 * count));
    EXPECT_GT(order, 2.7) << count;
    EXPECT_LT(order, 3.3) << count;
  }
}

TEST(MotionCurve, SineSwingsAboutItsValue) {
  const MotionCurve own(SineLaw{.amplitude = 10, .hz = 2, .phase = 0, .about = {}}, 200);
  EXPECT_EQ(own(0), 200);
  EXPECT_NEAR(own(0.125), 210, 1e-12);
  EXPECT_NEAR(own(0.375), 190, 1e-12);
  EXPECT_NEAR(own(0.7), own(0.2), 1e-12);
  const MotionCurve late(SineLaw{.amplitude = 10, .hz = 2, .phase = std::numbers::pi / 2, .about = 7}, 200);
  EXPECT_NEAR(late(0), 17, 1e-12);
  EXPECT_NEAR(late(0.25), -3, 1e-12);
}

// What is checked against a range are the extremes: no time on a fine grid is beyond them.
TEST(MotionCurve, TurnsHoldTheExtremes) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> value(-1, 1);
  for (int round = 0; round < 100; ++round) {
    const double seconds = 1.1 + value(random);
    std::vector<MotionCurve> curves = {
        {SineLaw{value(random), 1.01 + value(random), 9 * value(random), value(random)}, 0.0},
        {RateLaw{value(random)}, value(random)},
        through({{0, value(random)}, {0.02, value(random)}, {0.05, value(random)}})};
    for (const MotionCurve& curve : curves) {
      double low = HUGE_VAL;
      double high = -HUGE_VAL;
      for (const double t : curve.turns(seconds)) {
        EXPECT_GE(t, 0);
        EXPECT_LE(t, seconds);
        low = std::min(low, curve(t));
        high = std::max(high, curve(t));
      }
      for (int i = 0; i <= 2000; ++i) {
        EXPECT_GE(curve(seconds * i / 2000), low - 1e-12);
        EXPECT_LE(curve(seconds * i / 2000), high + 1e-12);
      }
    }
  }
}

TEST(Trajectory, AppliesItsStateInSiUnits) {
  const Scene scene = moving({{"body.place.at_mm[2]", RateLaw{50}},
                              {"body.place.rotate_deg.1", SineLaw{.amplitude = 5, .hz = 1, .phase = 0, .about = 45}},
                              {"body.hand.joints.index.mcp_deg", KeysLaw{{{0, 0}, {1, 30}}}},
                              {"body.hand.joints.middle.mcp_deg", RateLaw{1}},
                              {"body.hand.joints.thumb.ip_deg", RateLaw{-2}},
                              {"target.box.offset_mm[0]", RateLaw{3}},
                              {"target.pressure_pa", KeysLaw{{{0, 0}, {2, 3000}}}}});
  const Trajectory trajectory(scene);
  ASSERT_EQ(trajectory.size(), 7);
  EXPECT_EQ(trajectory.number(1).path, "body.place.rotate_deg[1]");
  Scene now = scene;
  trajectory.apply(trajectory.state(0), now);
  EXPECT_EQ(now.bodies[0].place.at, scene.bodies[0].place.at);                         // to the bit
  EXPECT_EQ(*std::get<HandShape>(now.bodies[0].shape).joints.thumb.ip, 58 * kDegree);  // the pose's own
  trajectory.apply(trajectory.state(1), now);
  EXPECT_NEAR(now.bodies[0].place.at.z(), 250.3e-3, 1e-15);
  EXPECT_EQ(now.bodies[0].place.at.x(), 0.1e-3);
  EXPECT_NEAR(now.bodies[0].place.angles.y(), 45 * kDegree, 1e-15);
  const HandJoints& joints = std::get<HandShape>(now.bodies[0].shape).joints;
  EXPECT_EQ(*joints.index.mcp, 30 * kDegree);
  EXPECT_NEAR(*joints.middle.mcp, 34 * kDegree, 1e-15);
  EXPECT_NEAR(*joints.thumb.ip, 56 * kDegree, 1e-15);
  EXPECT_FALSE(joints.index.pip);
  EXPECT_NEAR(now.target->boxes[0].offset.x(), 4e-3, 1e-15);
  EXPECT_NEAR(*now.target->pressure, 1500, 1e-9);
}

const std::vector<std::string> kOfRadiation = {"target.pressure_pa=null", "target.radiation_pa=30"};

TEST(Trajectory, AppliesARadiationPressure) {
  const Scene scene = moving({{"target.radiation_pa", KeysLaw{{{0, 0}, {2, 40}}}}}, kOfRadiation);
  Scene now = scene;
  const Trajectory trajectory(scene);
  trajectory.apply(trajectory.state(1), now);
  EXPECT_NEAR(*now.target->pressure, 20, 1e-12);
  EXPECT_EQ(now.target->quantity, TargetQuantity::kRadiation);
}

TEST(Trajectory, KnowsBodiesAndBoxesByNumber) {
  const Scene scene = scene_from(
      "name: two\narray: {grid: {}}\n"
      "bodies: [{name: a, sphere: {radius_mm: 8}, edge_mm: 2}, {name: b, sphere: {radius_mm: 8}, edge_mm: 2}]\n"
      "target: {boxes: [{at: a.top, size_mm: [1, 1, 1]}, {centre_mm: [1, 2, 3], size_mm: [1, 1, 1]}]}\n"
      "solve: {methods: [surface]}\n"
      "motion:\n"
      "  seconds: 1\n"
      "  change:\n"
      "    - {path: bodies.1.place.at_mm.0, rate: 1}\n"
      "    - {path: target.boxes.0.offset_mm.1, rate: 2}\n"
      "    - {path: target.boxes.1.centre_mm.2, rate: 3}\n");
  const Trajectory trajectory(scene);
  Scene now = scene;
  trajectory.apply(trajectory.state(1), now);
  EXPECT_NEAR(now.bodies[1].place.at.x(), 1e-3, 1e-15);
  EXPECT_EQ(now.bodies[0].place.at.x(), 0);
  EXPECT_NEAR(now.target->boxes[0].offset.y(), 2e-3, 1e-15);
  EXPECT_NEAR(now.target->boxes[1].centre.z(), 6e-3, 1e-15);
}

TEST(Trajectory, RefusesWhatCannotVary) {
  const auto refused = [](const std::vector<MotionChange>& changes, const std::vector<std::string>& overrides = {}) {
    return message_of<InputError>([&] { Trajectory trajectory(moving(changes, overrides)); });
  };
  const RateLaw rate{1};
  EXPECT_THAT(refused({{"array.level", rate}}),
              HasSubstr("array.level cannot vary, must be one of body.place.at_mm.0 to .2"));
  for (const std::string path :
       {"", "body", "body.place", "body.place.at_mm", "body.place.at_mm[3]", "body.place.at_mm[0][0]", "body.hand.pose",
        "body.hand.joints.index", "body.hand.joints.index.ip_deg", "body.hand.joints.toe.mcp_deg", "target.box",
        "target.box.size_mm[0]", "target.pressure_pa.0", "bodies.place.at_mm[0]", "body.place.at_mm[-1]", "a..b",
        "[0"}) {
    EXPECT_THAT(refused({{path, rate}}), HasSubstr("cannot vary")) << path;
  }
  EXPECT_THAT(refused({{"bodies[0].place.at_mm[0]", rate}}), HasSubstr("must begin with body"));
  EXPECT_THAT(refused({{"target.boxes[0].offset_mm[0]", rate}}), HasSubstr("must begin with target.box"));
  EXPECT_THAT(refused({{"target.box.centre_mm[0]", rate}}), HasSubstr("its box has a landmark"));
  EXPECT_THAT(refused({{"target.pressure_pa", rate}}, {"target.pressure_pa=best"}), HasSubstr("must be a number"));
  EXPECT_THAT(refused({{"target.radiation_pa", rate}}), HasSubstr("is not in this scene: its target has pressure_pa"));
  EXPECT_THAT(refused({{"target.pressure_pa", rate}}, kOfRadiation), HasSubstr("its target has radiation_pa"));
  EXPECT_THAT(refused({{"body.place.at_mm[0]", rate}, {"body.place.at_mm.0", rate}}), HasSubstr("changed twice"));
  EXPECT_THAT(refused({{"body.hand.joints.index.mcp_deg", rate}},
                      {"body={sphere: {radius_mm: 8}, edge_mm: 2}", "target.box.at=top"}),
              HasSubstr("not a built-in hand"));
}

TEST(Trajectory, RefusesToLeaveARange) {
  const auto refused = [](const MotionChange& change) {
    return message_of<InputError>([&] { Trajectory trajectory(moving({change})); });
  };
  EXPECT_EQ(refused({"target.pressure_pa", RateLaw{-1500}}), "target.pressure_pa is -1000 at 2 s, must be >= 0");
  EXPECT_EQ(refused({"body.hand.joints.index.mcp_deg", KeysLaw{{{0, 0}, {0.5, 91}, {1, 0}}}}),
            "body.hand.joints.index.mcp_deg is 91 at 0.5 s, must be 0 to 90");
  EXPECT_EQ(refused({"body.hand.joints.middle.mcp_deg", SineLaw{.amplitude = 40, .hz = 1, .phase = 0, .about = {}}}),
            "body.hand.joints.middle.mcp_deg is -7 at 0.75 s, must be 0 to 90");
  Trajectory at_its_ends(moving({{"body.hand.joints.index.mcp_deg", KeysLaw{{{0, 0}, {0.5, 90}}}}}));
  Eigen::VectorXd beyond(1);
  beyond << 1.7;
  EXPECT_EQ(at_its_ends.in_range(beyond)(0), 90 * kDegree);
  beyond << -0.1;
  EXPECT_EQ(at_its_ends.in_range(beyond)(0), 0);
  beyond << 0.3;
  EXPECT_EQ(at_its_ends.in_range(beyond)(0), 0.3);
}

}  // namespace touchfield::trajectory_test
