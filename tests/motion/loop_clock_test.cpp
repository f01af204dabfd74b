#include "sim/motion/loop_clock.h"

#include "tests/support/testing.h"

namespace touchfield::loop_clock_test {

constexpr Tick kMs = 1000;

MotionSpec loop(double seconds) {
  MotionSpec motion;
  motion.seconds = seconds;
  motion.solve = 20e-3;
  return motion;
}

/// Frames and scores of a motion whose frames take what is given, the last value from then on.
struct Played {
  std::vector<ShownFrame> frames;
  std::vector<ScoreInstant> scores;
};
Played play(LoopClock& clock, const std::vector<Tick>& solves) {
  Played played;
  const auto take_scores = [&] {
    while (const auto score = clock.next_score()) played.scores.push_back(*score);
  };
  while (const auto frame = clock.next()) {
    EXPECT_EQ(frame->number, static_cast<std::int64_t>(played.frames.size()));
    played.frames.push_back(clock.finished(solves[std::min(played.frames.size(), solves.size() - 1)]));
    take_scores();
  }
  take_scores();
  return played;
}

std::vector<Tick> starts(const Played& played) {
  std::vector<Tick> ticks;
  for (const ShownFrame& frame : played.frames) ticks.push_back(frame.start.at);
  return ticks;
}
std::vector<std::int64_t> samples(const Played& played) {
  std::vector<std::int64_t> numbers;
  for (const ShownFrame& frame : played.frames) numbers.push_back(frame.start.sample);
  return numbers;
}

// Sensor 30 Hz, frames 20 Hz, 20 ms, 1 ms to the array: frames start with samples of age 0 and 16.7 ms in turn, come on
// 21 ms later and stay for 50 ms. So ages run from 21 to 71 and from 37.7 to 87.7 ms: mean (46 + 62.7)/2 = 54.3 ms.
TEST(LoopClock, AgesOfTheWorkedExample) {
  MotionSpec motion = loop(10);
  motion.score_hz = 997;
  LoopClock clock(motion);
  const Played played = play(clock, {20 * kMs});
  ASSERT_EQ(played.frames.size(), 200U);
  EXPECT_EQ(played.frames[0].from, 21 * kMs);
  EXPECT_EQ(played.frames[1].start.sampled, 33'333);
  EXPECT_EQ(played.frames[1].from, 71 * kMs);
  EXPECT_EQ(played.frames[2].start.sample, 3);  // known at the very start
  EXPECT_EQ(played.frames[2].start.sampled, 100 * kMs);
  Tick least = 1'000'000;
  Tick most = 0;
  double sum = 0;
  double count = 0;
  for (const ScoreInstant& score : played.scores) {
    EXPECT_EQ(score.frame.has_value(), score.at >= 21 * kMs);
    if (!score.frame || score.at >= 9'921 * kMs) continue;  // whole pairs of frames
    least = std::min(least, score.age());
    most = std::max(most, score.age());
    sum += static_cast<double>(score.age());
    ++count;
  }
  EXPECT_EQ(played.scores.size(), 9970U);
  EXPECT_GE(least, 21 * kMs);
  EXPECT_LT(least, 21 * kMs + 200);
  EXPECT_LT(most, 87'667);
  EXPECT_GT(most, 87'667 - 200);
  EXPECT_NEAR(sum / count, 54'333, 30);
  EXPECT_EQ(clock.late() + clock.dropped() + clock.waiting(), 0);
}

TEST(LoopClock, SamplesAreKnownAfterTheirLatency) {
  MotionSpec motion = loop(0.4);
  motion.sensor.latency = 50e-3;
  LoopClock clock(motion);
  const Played played = play(clock, {20 * kMs});
  // At 0 nothing is known. Sample k is known at 50 + 33.3 k: at 50 (to the tick), 83.3, 116.7, 150 (to the tick) ms ...
  EXPECT_EQ(clock.waiting(), 1);
  EXPECT_EQ(clock.dropped(), 0);
  EXPECT_THAT(starts(played), ElementsAre(50 * kMs, 100 * kMs, 150 * kMs, 200 * kMs, 250 * kMs, 300 * kMs, 350 * kMs));
  EXPECT_THAT(samples(played), ElementsAre(0, 1, 3, 4, 6, 7, 9));
}

// Frames every 50 ms. The first takes 130: slots 50 and 100 pass, 100 gets its frame at 130, 50 is dropped. That takes
// 20, so that the solver is free at 150, which is a slot: on time.
TEST(LoopClock, ASlowSolveDelaysOneFrameAndDropsTheSlotsBefore) {
  LoopClock clock(loop(0.3));
  const Played played = play(clock, {130 * kMs, 20 * kMs});
  EXPECT_THAT(starts(played), ElementsAre(0, 130 * kMs, 150 * kMs, 200 * kMs, 250 * kMs));
  const FrameStart& late = played.frames[1].start;
  EXPECT_EQ(late.due, 100 * kMs);
  EXPECT_EQ(late.late(), 30 * kMs);
  EXPECT_EQ(late.dropped, 1);
  EXPECT_EQ(late.sample, 3);  // of 100 ms: the next is known at 133.3
  EXPECT_EQ(played.frames[2].start.dropped, 0);
  EXPECT_EQ(clock.late(), 1);
  EXPECT_EQ(clock.dropped(), 1);
  EXPECT_EQ(clock.frames(), 5);
}

TEST(LoopClock, ASolveThatOutlastsTheMotionDropsTheRest) {
  LoopClock clock(loop(0.3));
  const Played played = play(clock, {400 * kMs});
  EXPECT_EQ(clock.frames(), 1);
  EXPECT_EQ(clock.dropped(), 5);
  EXPECT_FALSE(clock.next());
  EXPECT_EQ(clock.dropped(), 5);
  for (const ScoreInstant& score : played.scores) EXPECT_FALSE(score.frame);
  EXPECT_EQ(played.scores.size(), 19U);  // 0 to 18 / 61 s
}

// With equal rates the sample of each slot is the slot's own, whatever the rate is in ticks.
TEST(LoopClock, EqualRatesNeverBeat) {
  for (const double hz : {7.0, 29.97, 30.0, 61.0, 333.3}) {
    MotionSpec motion = loop(20);
    motion.frames_hz = motion.sensor.hz = motion.score_hz = hz;
    motion.solve = 0.5 / hz;
    LoopClock clock(motion);
    const Played played = play(clock, {clock.expected_solve()});
    ASSERT_EQ(static_cast<double>(played.frames.size()), std::ceil(20 * hz));
    for (std::size_t i = 0; i < played.frames.size(); ++i) {
      EXPECT_EQ(played.frames[i].start.sample, static_cast<std::int64_t>(i));
      EXPECT_EQ(played.frames[i].start.at, played.frames[i].start.sampled);
      EXPECT_EQ(played.frames[i].start.at, std::llround(static_cast<double>(i) * 1e6 / hz));
    }
    EXPECT_EQ(clock.late() + clock.dropped(), 0);
  }
}

TEST(LoopClock, PredictsForTheMiddleOfTheTimeShown) {
  LoopClock clock(loop(1));
  clock.next();
  clock.finished(20 * kMs);
  const auto frame = clock.next();
  EXPECT_EQ(clock.predicted_for(*frame), (50 + 20 + 1 + 25) * kMs);
  EXPECT_EQ(clock.predicted_for(*frame, 7), (50 + 1 + 25) * kMs + 7);
  const ShownFrame shown = clock.finished(20 * kMs);
  clock.next();
  const ShownFrame after = clock.finished(20 * kMs);
  EXPECT_EQ(2 * clock.predicted_for(*frame), shown.from + after.from);
}

TEST(LoopClock, ExpectsTheMedianOfMeasuredSolves) {
  MotionSpec motion = loop(10);
  motion.solve.reset();
  LoopClock clock(motion);
  EXPECT_EQ(clock.expected_solve(), 0);
  const auto solve = [&](Tick ticks) {
    ASSERT_TRUE(clock.next());
    clock.finished(ticks);
  };
  solve(9);
  EXPECT_EQ(clock.expected_solve(), 9);
  solve(5);
  EXPECT_EQ(clock.expected_solve(), 5);
  solve(100);
  EXPECT_EQ(clock.expected_solve(), 9);
  for (std::size_t i = 0; i < RunningMedian::kRemembered / 2 - 1; ++i) solve(1);
  EXPECT_EQ(clock.expected_solve(), 1);
  for (std::size_t i = 0; i < RunningMedian::kRemembered; ++i) solve(70);  // and the first are forgotten
  EXPECT_EQ(clock.expected_solve(), 70);
}

TEST(RecordedTimes, InAnotherUnitAreSaid) {
  const auto said = [](double step, double hz) {
    return step_warning(RecordedTimes({5 * step, 6 * step, 7 * step, 9 * step}), hz);
  };
  for (const auto& [each, unit] :
       {std::pair(1e3, "divide it by 1000 if it is in ms"), std::pair(1e6, "divide it by 1000000 if it is in us"),
        std::pair(1e9, "if it is in ns"), std::pair(30.0, "set motion.sensor.hz to about 1")}) {
    EXPECT_THAT(said(each / 30, 30), HasSubstr(unit));
  }
  for (const auto& [step, hz] : {std::pair(1.0 / 290, 30.0), std::pair(0.3, 30.0), std::pair(1.0, 1.0)}) {
    EXPECT_EQ(said(step, hz), "") << step;
  }
  EXPECT_EQ(step_warning(RecordedTimes({7.0}), 30), "");
}

}  // namespace touchfield::loop_clock_test
