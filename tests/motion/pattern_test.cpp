#include "sim/motion/pattern.h"

#include <numbers>

#include <gtest/gtest.h>

#include "sim/field/metrics.h"
#include "sim/field/target_parts.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

using support::message_of;
using support::small_model;

Model circling(std::vector<std::string> changes = {}) {
  changes.insert(changes.begin(),
                 {"target.pressure_pa=500", "body.edge_mm=1.6", "pattern.circle={at: bottom, radius_mm: 2, hz: 50}",
                  "pattern.frames_per_second=400"});
  return small_model(changes);
}

PatternSpec spec_of(const Model& model) { return *model.fixed->scene.pattern; }

Pattern solved(const Model& model, PatternOptions options = {}) {
  Progress silent;
  return solve_pattern(model, options, silent);
}

/// That of circling(), every other frame compared with what it is alone.
const Pattern& circling_pattern() {
  static const Pattern kPattern = solved(circling(), {.command_line = {}, .check = 2});
  return kPattern;
}

double turn(double from, double to) { return std::abs(std::remainder(to - from, 2.0 * std::numbers::pi)); }

TEST(PatternClock, HasWholePeriodsAndWholeFrames) {
  PatternSpec spec;
  spec.path = CirclePath{.at = "x", .hz = 70};
  EXPECT_EQ(pattern_clock(spec).frames, 100);  // 7 turns
  spec.amplitude = PatternSpec::Amplitude{.hz = 25};
  EXPECT_EQ(pattern_clock(spec).frames, 200);  // 14 turns, 5 sines
  EXPECT_DOUBLE_EQ(pattern_clock(spec).seconds(), 0.2);
  spec.seconds = 0.05;
  EXPECT_EQ(pattern_clock(spec).frames, 50);
}

TEST(PatternSpots, GoRoundTheCircleOnTheSkin) {
  const Model model = circling();
  const PatternSpec spec = spec_of(model);
  const PatternClock clock = pattern_clock(spec);
  ASSERT_EQ(clock.frames, 8);
  const std::vector<PatternPoint> points = pattern_points(spec, model);
  const PatternSpots spots = pattern_spots(spec, clock, points, model);
  const TriangleMesh& mesh = model.body.mesh;
  const Vector3 centre = position(mesh, find_landmark(model.body, "bottom"));
  for (Eigen::Index k = 0; k < clock.frames; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / 8.0;
    // Seen from below, the skin's outside, the circle turns to the left: its plane's second axis is normal x right.
    const Vector3 at = centre + 2e-3 * Vector3(std::cos(angle), -std::sin(angle), 0.0);
    Vector3 middle = Vector3::Zero();
    double area = 0.0;
    for (Eigen::Index j = 0; j < spots.amplitudes.rows(); ++j) {
      const double share = spots.shares(j, k);
      const Eigen::Index face = spots.faces[static_cast<std::size_t>(j)];
      const double flat = (mesh.centroids().col(face) - at).head<2>().norm();
      if (spots.amplitudes(j, k) > 0) {
        EXPECT_EQ(spots.amplitudes(j, k), 500.0);
        EXPECT_LT(flat, 3.3e-3);
        EXPECT_TRUE(share == 1.0 || flat > 1.0e-3) << flat;
        EXPECT_LT(mesh.normals()(2, face), 0.0);
        middle += share * mesh.areas()(face) * mesh.centroids().col(face);
        area += share * mesh.areas()(face);
      } else {
        EXPECT_TRUE(flat > 1.7e-3 || mesh.normals()(2, face) > 0) << face;
      }
    }
    EXPECT_LT((middle / area - at).head<2>().norm(), 0.3e-3) << k;
    EXPECT_NEAR(area, 4e-6 * std::numbers::pi, 0.05 * 4e-6 * std::numbers::pi);
    EXPECT_GT(spots.amplitudes(spots.middle[static_cast<std::size_t>(k)], k), 0.0);
  }
}

TEST(PatternSpots, WantTheAmplitudeOfTheTargetsRadiationPressure) {
  const Model model = circling({"target.pressure_pa=null", "target.radiation_pa=30"});
  const PatternSpots spots = pattern_spots(spec_of(model), pattern_clock(spec_of(model)), {}, model);
  EXPECT_DOUBLE_EQ(spots.amplitudes.maxCoeff(), build_target(model).amplitudes.maxCoeff());
  EXPECT_NEAR(spots.amplitudes.maxCoeff(), 4126, 1);  // in air of 20 C
}

TEST(PatternSpots, StayAsLongAtEachPointAndRunToAndFroOnALine) {
  const Model model =
      small_model({"target.pressure_pa=500", "body.edge_mm=1.6",
                   "pattern={points: {at: [bottom, [3, 0, 51], [-3, 0, 51]], hz: 10}, frames_per_second: 90}"});
  const PatternSpec spec = spec_of(model);
  const PatternClock clock = pattern_clock(spec);
  const PatternSpots spots = pattern_spots(spec, clock, pattern_points(spec, model), model);
  ASSERT_EQ(spots.middle.size(), 9U);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(spots.middle[k], spots.middle[k / 3 * 3]) << k;
  EXPECT_NE(spots.middle[0], spots.middle[3]);
  EXPECT_NE(spots.middle[3], spots.middle[6]);
  PatternSpec line = spec;
  line.path = LinePath{Vector3(-3e-3, 0, 0.051), Vector3(3e-3, 0, 0.051), 10};
  line.frames_hz = 80;
  const PatternSpots there = pattern_spots(line, pattern_clock(line), pattern_points(line, model), model);
  ASSERT_EQ(there.middle.size(), 8U);
  for (std::size_t k = 1; k < 4; ++k) EXPECT_EQ(there.middle[k], there.middle[8 - k]);
  for (std::size_t k = 0; k < 5; ++k) {
    const Eigen::Index face = there.faces[static_cast<std::size_t>(there.middle[k])];
    EXPECT_NEAR(model.body.mesh.centroids()(0, face), (1.5 * static_cast<double>(k) - 3) * 1e-3, 1e-3) << k;
  }
}

// Errors by rows of H and R are those of all faces by a solution of their own.
TEST(SolvedPattern, ScoresItsFramesAsAllFacesDo) {
  const Model model = circling();
  const Pattern& pattern = circling_pattern();
  ASSERT_EQ(pattern.motion.instants.size(), 8U);
  for (std::size_t k = 0; k < 8; ++k) {
    const MotionInstant& instant = pattern.motion.instants[k];
    const Metrics all = pattern_metrics(model.body.mesh, model.boxes, *instant.target, instant.pressure.front().second);
    const Metrics& score = pattern.motion.methods.front().scores[k].metrics;
    EXPECT_NEAR(score.relative_error, all.relative_error, 2e-3);
    EXPECT_NEAR(score.relative_error_raw, all.relative_error_raw, 2e-3);
    EXPECT_NEAR(score.leakage, all.leakage, 2e-3);
    EXPECT_NEAR(score.scale, all.scale, 2e-3 * all.scale);
    EXPECT_NEAR(score.mean_inside_pa, all.mean_inside_pa, 2e-3 * all.mean_inside_pa);
    EXPECT_NEAR(score.reached_share, all.reached_share, 2e-3);
    EXPECT_NEAR(score.cv_inside, all.cv_inside, 5e-3);
    EXPECT_LT(score.relative_error, 0.9);
  }
  EXPECT_LT(pattern.reduced_off, 2e-3);
}

TEST(SolvedPattern, OfRadiationKeepsTheRoundBorderOfItsSpots) {
  const Pattern pattern = solved(circling({"pattern.method=radiation"}));
  const double disc = 4e-6 * std::numbers::pi;
  for (const MotionInstant& instant : pattern.motion.instants) {
    ASSERT_EQ(instant.target->boxes.size(), 1U);
    const TargetBox& box = instant.target->boxes.front();
    EXPECT_EQ(box.shape, TargetShape::kCylinder);
    const Eigen::VectorXd flat = (box.rotation.col(2).transpose() * instant.mesh.normals()).cwiseAbs();
    double area = 0.0;  // seen along the disc's axis
    for (const FacePart& part : face_parts(instant.mesh, {box})) area += part.area * flat(part.face);
    EXPECT_NEAR(area, disc, 0.01 * disc);
    const Eigen::VectorXd areas = instant.mesh.areas().cwiseProduct(flat)(instant.target->faces);
    EXPECT_NEAR(areas.dot(instant.target->shares), disc, 0.01 * disc);
  }
  EXPECT_LT(pattern.motion.methods.front().scores.front().metrics.relative_error_radiation, 1.0);
}

TEST(SolvedPattern, FramesAreNearlyAsGoodAsAlone) {
  const Pattern& pattern = circling_pattern();
  for (std::size_t k = 0; k < 8; ++k) {
    const double alone = pattern.frames[k].alone_error;
    EXPECT_EQ(std::isnan(alone), k % 2 == 1);
    if (k % 2 == 0) {
      EXPECT_LT(pattern.motion.methods.front().scores[k].metrics.relative_error, alone + 0.06) << k;
    }
  }
}

TEST(SolvedPattern, KeepsTheLimitAllTheWayRound) {
  constexpr double kMost = 25.0 * std::numbers::pi / 180.0;
  EXPECT_GT(circling_pattern().frames[1].turn, kMost);
  const Pattern pattern = solved(circling({"pattern.most_turn_deg=25"}));
  const std::vector<MotionFrame>& frames = pattern.motion.methods.front().frames;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Eigen::VectorXd& before = frames[(k + frames.size() - 1) % frames.size()].solution.phases;
    double largest = 0.0;
    for (Eigen::Index n = 0; n < before.size(); ++n) {
      largest = std::max(largest, turn(before(n), frames[k].solution.phases(n)));
    }
    EXPECT_LE(largest, kMost + 1e-12) << k;
    EXPECT_DOUBLE_EQ(pattern.frames[k].turn, largest);
  }
}

// |p| follows 1 - d (1 - cos)/2, so its square has lines at hz and 2 hz alone.
TEST(SolvedPattern, AmplitudeAloneModulatesTheTarget) {
  const Model model =
      small_model({"target.pressure_pa=300", "pattern={amplitude: {hz: 100, depth: 0.6}, frames_per_second: 2000}"});
  const Pattern pattern = solved(model);
  ASSERT_EQ(pattern.clock.frames, 20);
  const PatternSound& sound = pattern.sounds.front();
  EXPECT_EQ(sound.point.name, "target");
  EXPECT_NEAR(sound.pressure.minCoeff(), 0.4 * sound.pressure.maxCoeff(), 1e-9);
  EXPECT_NEAR(sound.pressure(5), 0.7 * sound.pressure(0), 1e-9 * sound.pressure(0));
  ASSERT_EQ(sound.lines.size(), 5U);
  EXPECT_GT(sound.lines[0].mean_square, 10.0 * sound.lines[1].mean_square);
  EXPECT_GT(sound.lines[1].mean_square, 1e12 * sound.lines[2].mean_square);
  const Medium& air = model.fixed->wave.medium();
  EXPECT_NEAR(sound.radiation(0), std::pow(sound.pressure(0), 2) / (4.0 * air.density * std::pow(air.sound_speed, 2)),
              1e-12);
  const auto& scores = pattern.motion.methods.front().scores;
  EXPECT_NEAR(scores[10].metrics.relative_error_raw, scores[0].metrics.relative_error_raw, 1e-9);
  EXPECT_NEAR(scores[10].metrics.mean_inside_pa, 0.4 * scores[0].metrics.mean_inside_pa, 1e-9);
}

TEST(SolvedPattern, FullDepthHasASilentFrame) {
  const Model model = small_model({"target.pressure_pa=300", "pattern={amplitude: {hz: 100}, frames_per_second: 400}"});
  const Pattern pattern = solved(model);
  EXPECT_TRUE(pattern.motion.methods.front().frames[2].silent);
  EXPECT_TRUE(std::isnan(pattern.motion.methods.front().scores[2].metrics.relative_error));
}

// A pass of two frames has a steady state in closed form: e alternates about the mean by (q0 - q1)/2 tanh(T / 2 tau) at
// the ends of frames.
TEST(RungUp, TwoFramesAlternateAsInClosedForm) {
  Eigen::MatrixXcd drives(1, 2);
  drives << Complex(1, 0), Complex(0, 1);
  constexpr double kFrame = 1e-3;
  constexpr double kTau = 0.7e-3;
  const Complex mean = 0.5 * (drives(0, 0) + drives(0, 1));
  const Complex end_of_second = mean - 0.5 * (drives(0, 0) - drives(0, 1)) * std::tanh(0.5 * kFrame / kTau);
  const Complex middle = drives(0, 0) + (end_of_second - drives(0, 0)) * std::exp(-0.5 * kFrame / kTau);
  const Eigen::MatrixXcd emitted = rung_up(drives, kFrame, kTau);
  EXPECT_LT(std::abs(emitted(0, 0) - middle), 1e-14);
  EXPECT_LT((rung_up(drives, kFrame, 1e-6) - drives).norm(), 1e-12);
  EXPECT_LT(
      (rung_up(Eigen::MatrixXcd::Constant(3, 5, 0.3), kFrame, 0.1) - Eigen::MatrixXcd::Constant(3, 5, 0.3)).norm(),
      1e-12);
}

TEST(SolvedPattern, SlowTransducersCostError) {
  const Pattern pattern = solved(circling({"pattern.ring_up_ms=1"}));
  for (std::size_t k = 0; k < 8; ++k) {
    EXPECT_GT(pattern.frames[k].ring_error, pattern.motion.methods.front().scores[k].metrics.relative_error);
  }
  EXPECT_TRUE(std::isnan(circling_pattern().frames[0].ring_error));
}

}  // namespace
}  // namespace touchfield
