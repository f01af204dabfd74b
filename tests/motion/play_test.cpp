#include "sim/motion/play.h"

#include "sim/jobs/play_scene.h"
#include "sim/run/solve_model.h"
#include "tests/support/moving_support.h"
#include "tests/support/scene_support.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::play_test {

Motion played(const std::vector<std::string>& overrides = {}, const MotionOptions& options = {}) {
  Progress silent;
  return play_motion(sensed_motion(scene_from(kMovingCapsule, overrides)), options, silent);
}

const char* const kRest = "motion.change=[{path: 'body.place.at_mm[0]', rate: 0}]";

/// Hears what begins and how far it comes.
class Hearing : public Progress {
 public:
  void begin(std::string_view what) override { stages.emplace_back(std::string(what), 0.0); }
  void advance(double fraction) override {
    EXPECT_GE(fraction, stages.back().second) << stages.back().first;
    stages.back().second = fraction;
    ++steps;
  }
  std::vector<std::pair<std::string, double>> stages;
  int steps = 0;
};

// An hour that swings is looked through where it is somewhere else: a thousandth of the way.
TEST(PlayMotion, ALongMotionIsCheckedWhereItGoes) {
  const auto swinging = [](double amplitude) {
    return std::vector<std::string>{"motion.seconds=3600",
                                    "motion.change=[{path: 'body.place.at_mm[2]', sine: {amplitude: " +
                                        std::to_string(amplitude) + ", hz: 0.37}}]"};
  };
  Hearing hearing;
  MovingModel(scene_from(kMovingCapsule, swinging(10)), nullptr, &hearing);
  ASSERT_EQ(hearing.stages.size(), 1U);
  EXPECT_THAT(hearing.stages[0].first, MatchesRegex("check 3600 s of motion at [0-9]+ times"));
  EXPECT_EQ(hearing.stages[0].second, 1.0);
  EXPECT_LE(hearing.steps, 1001);
  EXPECT_GT(hearing.steps, 200);
  // The capsule's lowest point is above the array by less than that.
  EXPECT_THAT(message_of<InputError>([&] { MovingModel(scene_from(kMovingCapsule, swinging(90))); }),
              HasSubstr("motion: at 1."));
}

TEST(PlayMotion, ABodyAtRestComesToTheErrorOfARun) {
  const Motion motion = played({kRest, "motion.seconds=0.55"});
  const auto run = solve_model(build_model(scene_from(kMovingCapsule)));
  for (std::size_t m = 0; m < motion.methods.size(); ++m) {
    const MotionScore& last = motion.methods[m].scores.back();
    EXPECT_GE(last.frame, 9);
    EXPECT_NEAR(last.metrics.relative_error, run.methods[m].metrics.relative_error, 0.005) << run.methods[m].name;
    EXPECT_LT(last.displacement.norm(), 1e-12);
  }
}

// The error at an instant is that of the phases at rest on a body that stands as far on as the sample is old.
TEST(PlayMotion, EveryScoreHasTheErrorOfItsOwnDisplacement) {
  const Motion motion = played({"motion.seconds=0.4", "solve.methods=[surface]"});
  const Motion still = played({kRest, "motion.seconds=0.55", "solve.methods=[surface]"});
  const PhaseSolution held = still.methods.front().frames.back().solution;
  int compared = 0;
  for (const MotionScore& score : motion.methods.front().scores) {
    if (score.frame < 4) {
      continue;  // five steps a frame: at its best from the fourth on
    }
    Model moved = build_model(
        scene_from(kMovingCapsule, {"body.place.at_mm=[" + std::to_string(1e3 * score.displacement.x()) + ", 0, 80]"}));
    MethodSpec fixed;
    fixed.name = "held";
    fixed.kind = &phase_method("fixed");
    fixed.phases.assign(held.phases.begin(), held.phases.end());
    own_part(moved).scene.solve.methods = {fixed};
    EXPECT_NEAR(score.metrics.relative_error, solve_model(moved).methods.front().metrics.relative_error, 0.02)
        << score.time << " s, " << 1e3 * score.displacement.x() << " mm";
    EXPECT_NEAR(score.displacement.x(), 0.05 * score.age, 1e-9);
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

// Constant velocity: at the instant that is predicted for, the skin is where it was expected.
class PlayedAhead : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, PlayedAhead, ::testing::Values("linear", "kalman"));

TEST_P(PlayedAhead, MeetsAConstantVelocity) {
  const Motion motion = played({"motion.predict=" + std::string(GetParam()), "motion.seconds=0.5",
                                "motion.score_hz=1000", "solve.methods=[surface]"});
  int met = 0;
  for (const MotionScore& score : motion.methods.front().scores) {
    if (score.frame < 4) continue;
    const MotionFrame& frame = motion.methods.front().frames[static_cast<std::size_t>(score.frame)];
    if (std::abs(score.time - frame.pose_time) < 0.5e-3) {
      const std::string there = "body.place.at_mm=[" + std::to_string(50 * frame.pose_time) + ", 0, 80]";
      const auto rest = solve_model(build_model(scene_from(kMovingCapsule, {there, "solve.methods=[surface]"})));
      EXPECT_NEAR(score.metrics.relative_error, rest.methods.front().metrics.relative_error, 0.01) << score.time;
      ++met;
    }
  }
  EXPECT_GE(met, 3);
}

TEST(PlayMotion, KeepsInstantsWithTheSkinThatTheSensorSawForTheFrameThatIsShown) {
  const Scene scene =
      scene_from(kMovingCapsule, {"motion.seconds=1", "motion.score_hz=100", "solve.methods=[focus]",
                                  "motion.predict=none", "motion.change=[{path: 'body.place.at_mm[0]', rate: 20}]",
                                  "motion.sensor={noise: {noise_mm_rms: 0.1, correlation_mm: 4}}"});
  const SensedMotion sensed = sensed_motion(scene);
  Progress progress;
  const Motion motion = play_motion(sensed, {}, progress);
  const MotionMethod& focus = motion.methods.front();
  ASSERT_EQ(motion.instants.size(), 48U);
  std::size_t seen = 0;
  for (const MotionInstant& instant : motion.instants) {
    const auto score = std::ranges::find(focus.scores, instant.time, &MotionScore::time);
    ASSERT_NE(score, focus.scores.end());
    EXPECT_EQ(instant.sensed.has_value(), score->frame >= 0);
    if (instant.sensed) {
      const MovingModel& truth = *sensed.truth;
      const TriangleMesh then = truth.at(truth.state(instant.time - score->age)).body.mesh;
      EXPECT_LT((instant.sensed->vertices() - then.vertices()).rowwise().mean().norm(), 0.1e-3);
      EXPECT_GT((instant.sensed->vertices() - then.vertices()).norm(), 0);
      ++seen;
    }
  }
  EXPECT_GT(seen, 40U);
}

TEST(MovingModel, NamesWhenAMotionLeadsIntoTheArray) {
  const std::string message = message_of<InputError>(
      [] { MovingModel(scene_from(kMovingCapsule, {"motion.change=[{path: 'body.place.at_mm[2]', rate: -400}]"})); });
  EXPECT_THAT(message, HasSubstr("motion: at 0.200 s: array: the body cuts through the board"));
}

TEST(MovingModel, NamesWhenBodiesMeet) {
  const std::string two =
      "name: two\narray: {grid: {count: [8, 8]}}\n"
      "bodies:\n"
      "  - {name: left, sphere: {radius_mm: 6}, place: {at_mm: [-10, 0, 80]}, edge_mm: 3}\n"
      "  - {name: right, sphere: {radius_mm: 6}, place: {at_mm: [10, 0, 80]}, edge_mm: 3}\n"
      "target: {box: {centre_mm: [-10, 0, 74], size_mm: [5, 5, 4]}, pressure_pa: 1000}\n"
      "solve: {methods: [surface]}\n"
      "motion: {seconds: 0.2, change: [{path: 'bodies[1].place.at_mm[0]', rate: -100}]}\n";
  const std::string message = message_of<InputError>([&] { MovingModel(scene_from(two)); });
  EXPECT_THAT(message, HasSubstr("motion: at 0.090 s: bodies: left and right intersect"));
}

TEST(MovingModel, NothingOfStillsIsTakenSilently) {
  EXPECT_THAT(message_of<InputError>([] { MovingModel(scene_from(kMovingCapsule, {"sensing={noise_mm_rms: 0.5}"})); }),
              HasSubstr("sensing: applies to a still only. For a motion put the same keys into motion.sensor.noise"));
}

}  // namespace touchfield::play_test
