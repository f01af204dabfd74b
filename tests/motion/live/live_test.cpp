// The live loop with its threads on a clock that waits for them, a solver of choice, and a link that notes.
#include "sim/motion/live.h"

#include "apps/commands/live_stream.h"
#include "hardware/player.h"
#include "sim/jobs/play_scene.h"
#include "sim/motion/frame_solver.h"
#include "tests/support/moving_support.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::live_test {

constexpr double kForEver = 1e9;
constexpr double kBegin = 100;    // of no meaning
constexpr double kLook = 1.1e-3;  // [s] until the player has seen something

/// A clock that stands while a thread runs: once all of them wait, it goes on to the earliest moment that one waits for
/// and lets that one run alone. So what happens on it repeats.
class TurnTime final : public LiveTime {
 public:
  explicit TurnTime(int threads) : threads_(threads) {}

  double now() override {
    const std::lock_guard lock(mutex_);
    return now_;
  }

  /// Of a loop's threads, which leave it as they end.
  void wait_until(double t, const std::stop_token& stop) override {
    thread_local struct Leaver {
      TurnTime* time = nullptr;
      ~Leaver() {
        if (time != nullptr) time->leave();
      }
    } leaver;
    leaver.time = this;
    wait(t, stop);
  }

  /// Nobody waits any more.
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    waiting_.clear();
    changed_.notify_all();
  }

  void wait(double t, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    if (t <= now_ || ended_) return;
    const std::pair<double, int> turn(t, turns_++);
    waiting_.insert(turn);
    go_on();
    changed_.wait(lock, stop, [&] { return !waiting_.contains(turn); });
    waiting_.erase(turn);
  }

 private:
  void leave() {
    const std::lock_guard lock(mutex_);
    --threads_;
    go_on();
  }

  void go_on() {
    if (waiting_.empty() || static_cast<int>(waiting_.size()) < threads_) return;
    now_ = std::max(now_, waiting_.begin()->first);
    waiting_.erase(waiting_.begin());
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable_any changed_;
  int threads_;
  int turns_ = 0;
  bool ended_ = false;
  double now_ = kBegin;
  std::set<std::pair<double, int>> waiting_;
};

/// Stops a loop, whose threads then come to their end.
bool ended(LiveLoop& loop, TurnTime& time) {
  loop.stop(0);
  time.end();
  return loop.stop(10);
}

class TurnPace final : public Pace {
 public:
  explicit TurnPace(TurnTime& time) : time_(time) {}
  double now() override { return time_.now(); }
  bool wait_until(double t) override {
    time_.wait(t, {});
    return time_.now() < stop_at;
  }
  double stop_at = kForEver;

 private:
  TurnTime& time_;
};

class NotingLink final : public ArrayLink {
 public:
  struct Sent {
    double at;
    int number;  // of the frame
    bool on;
  };

  explicit NotingLink(Pace& pace) : pace_(pace) {}
  std::string describe() const override { return "noting link"; }
  const ArrayLayout& layout() const override { return layout_; }
  LinkAbilities abilities() const override { return {{256, 256}, 1000, {}}; }
  void open() override {}
  void set_modulation(const Modulation&) override {}
  void send(const DriveFrame& frame) override {
    if (static_cast<int>(sent.size()) == lost_at) throw DeviceError("lost");
    pace_.wait_until(pace_.now() + busy);
    sent.push_back({pace_.now() - kBegin, frame.phase[0], frame.intensity[0] > 0});
  }
  void silence() override { sent.push_back({pace_.now() - kBegin, -1, false}); }
  void close() noexcept override {}

  /// What it holds at a time.
  bool on_at(double t) const {
    bool on = false;
    for (const Sent& s : sent) on = s.at <= t ? s.on : on;
    return on;
  }
  std::vector<int> frames() const {
    std::vector<int> numbers;
    for (const Sent& s : sent) {
      if (s.on) numbers.push_back(s.number);
    }
    return numbers;
  }

  std::vector<Sent> sent;
  double busy = 0;
  int lost_at = -1;

 private:
  Pace& pace_;
  ArrayLayout layout_{Points::Zero(3, 1), Points::Zero(3, 1), {}, {}};
};

MotionSpec motion_of(double seconds) {
  MotionSpec motion;
  motion.seconds = seconds;
  motion.sensor.latency = 5e-3;
  return motion;
}

DriveFrame rounded(const Drive& drive) {
  return {{static_cast<std::uint8_t>(drive.phases(0))}, {static_cast<std::uint8_t>(255 * drive.amplitudes(0))}};
}

/// Its state is its time.
Seen seen_at(double seconds) { return {seconds, {Eigen::VectorXd::Constant(1, seconds)}}; }

/// Frame k is the phase k.
LiveSolution solution_of(std::size_t k) {
  LiveSolution solution;
  solution.frame.solution.phases = Eigen::VectorXd::Constant(1, static_cast<double>(k));
  solution.frame.solution.amplitudes = Eigen::VectorXd::Ones(1);
  return solution;
}

class Live : public ::testing::Test {
 protected:
  void TearDown() override {
    if (loop_) ended(*loop_, time_);
  }

  struct Asked {
    LiveSample sample;
    double wanted;  // [s]
    double at;
  };

  PlayReport play_it() {
    const LiveSensor sensor = [this](std::int64_t, double seconds) {
      sensing_(seconds);
      return seen_at(seconds);
    };
    const auto prepare = [this] {
      return [this](const LiveSample& sample, double wanted) {
        asked_.push_back({sample, wanted, time_.now() - kBegin});
        const std::size_t k = asked_.size() - 1;
        LiveSolution solution = solution_of(k);
        solving_(k, solution);
        return solution;
      };
    };
    loop_.emplace(motion_, sensor, prepare, time_, recorded_ ? &*recorded_ : nullptr);
    while (!loop_->ready(1)) {
    }
    PlayReport report;
    play(stream_of(*loop_, motion_, rounded), link_, motion_.seconds, pace_, report);
    return report;
  }

  /// In a thread of the loop.
  void pass(double seconds) { time_.wait_until(time_.now() + seconds, {}); }

  MotionSpec motion_ = motion_of(1);
  TurnTime time_{3};
  TurnPace pace_{time_};
  NotingLink link_{pace_};
  std::function<void(double)> sensing_ = [](double) {};
  std::function<void(std::size_t, LiveSolution&)> solving_ = [this](std::size_t, LiveSolution&) { pass(0.02); };
  std::vector<Asked> asked_;
  std::optional<RecordedTimes> recorded_;
  std::optional<LiveLoop> loop_;
};

// Frames, samples, what is late and what is dropped are those of the clock that plays motions.
TEST_F(Live, KeepsTheClockOfAPlay) {
  for (const double solve : {0.02, 0.05, 0.0501, 0.13, 0.4}) {
    TurnTime time(3);
    TurnPace pace(time);
    NotingLink link(pace);
    MotionSpec motion = motion_of(2);
    motion.stale = 10;
    motion.sensor.hz = 29;  // never known at the very tick that a frame starts
    std::vector<double> samples;
    LiveLoop loop(
        motion, [](std::int64_t, double s) { return seen_at(s); },
        [&] {
          return [&](const LiveSample& sample, double) {
            samples.push_back(sample.now.seconds);
            EXPECT_EQ(sample.now.state.numbers(0), sample.now.seconds);
            time.wait_until(time.now() + solve, {});
            return solution_of(samples.size() - 1);
          };
        },
        time);
    while (!loop.ready(1)) {
    }
    PlayReport played;
    play(stream_of(loop, motion, rounded), link, motion.seconds, pace, played);
    ASSERT_TRUE(ended(loop, time));
    const LiveReport report = loop.report();
    motion.solve = solve;
    LoopClock clock(motion);
    std::size_t k = 0;
    while (const auto start = clock.next()) {
      const ShownFrame shown = clock.finished(to_ticks(solve));
      ASSERT_LT(k, samples.size());
      EXPECT_EQ(samples[k], to_seconds(start->sampled)) << solve << " " << k;
      if (to_seconds(shown.from) > motion.seconds) break;  // it ended before
      ASSERT_LT(k, report.frames.size());
      EXPECT_NEAR(report.frames[k].started, to_seconds(start->at), 2e-6);
      EXPECT_NEAR(report.frames[k].late, to_seconds(start->late()), 2e-6);
      ++k;
    }
    EXPECT_EQ(report.waiting, clock.waiting());
    EXPECT_GE(report.late, clock.late() - 1) << solve;
    EXPECT_LE(report.late, clock.late()) << solve;
  }
}

TEST_F(Live, SendsFramesInOrderAsSoonAsTheyAreThere) {
  const PlayReport played = play_it();
  ASSERT_TRUE(ended(*loop_, time_));
  const LiveReport report = loop_->report();
  ASSERT_GE(report.frames.size(), 19U);
  std::vector<int> all;
  for (std::size_t k = 0; k < report.frames.size(); ++k) {
    const MotionFrame& frame = report.frames[k];
    all.push_back(static_cast<int>(k));
    EXPECT_NEAR(report.solved[k], frame.started + 0.02, 1e-9);
    EXPECT_GE(frame.shown, report.solved[k]);
    EXPECT_LE(frame.shown, report.solved[k] + kLook);
    EXPECT_EQ(frame.solution.phases.size(), 0);
  }
  EXPECT_EQ(link_.frames(), all);
  EXPECT_EQ(played.sent, report.frames.size());
  EXPECT_EQ(played.silences, 0U);
  EXPECT_EQ(report.dropped, 0);
  EXPECT_FALSE(played.stopped);
}

// A link that is slower than the solver: the newest wins.
TEST_F(Live, OvertakenFramesAreNotSent) {
  link_.busy = 0.12;
  motion_.stale = 10;
  play_it();
  const std::vector<int> numbers = link_.frames();
  ASSERT_GE(numbers.size(), 6U);
  for (std::size_t k = 1; k + 1 < numbers.size(); ++k) {
    EXPECT_GE(numbers[k] - numbers[k - 1], 2);
    EXPECT_LE(numbers[k] - numbers[k - 1], 3);
  }
  ASSERT_TRUE(ended(*loop_, time_));
  EXPECT_TRUE(std::isnan(loop_->report().frames[1].shown));
}

// The camera's clock is not the loop's: by a rate alone, some images would be read twice and their neighbours never.
TEST_F(Live, TakesEachRecordedImageAtItsOwnTime) {
  std::vector<double> images;
  for (int k = 0; k < 20; ++k) images.push_back(1000 + k / 30.0 + (k % 3 - 1) * 4e-3);
  recorded_.emplace(images);
  for (double& image : images) image -= 1000 - 4e-3;
  std::vector<std::pair<double, double>> sensed;  // image, and when it was asked for
  sensing_ = [&](double seconds) { sensed.emplace_back(seconds, time_.now() - kBegin); };
  play_it();
  ASSERT_TRUE(ended(*loop_, time_));
  ASSERT_EQ(sensed.size(), images.size());
  for (std::size_t k = 0; k < images.size(); ++k) {
    EXPECT_NEAR(sensed[k].first, images[k], 1e-6);
    EXPECT_NEAR(sensed[k].second, images[k] + motion_.sensor.latency, 2e-6);
  }
  EXPECT_EQ(loop_->report().overtaken, 0);
}

TEST_F(Live, IsSilentAtTheEnd) {
  play_it();
  EXPECT_EQ(link_.sent.back().number, -1);
  EXPECT_NEAR(link_.sent.back().at, 1, 1e-9);
}

TEST_F(Live, IsSilentWhenASignalStopsIt) {
  pace_.stop_at = kBegin + 0.42;
  EXPECT_TRUE(play_it().stopped);
  EXPECT_TRUE(link_.on_at(0.4199));
  EXPECT_EQ(link_.sent.back().number, -1);
  EXPECT_NEAR(link_.sent.back().at, 0.42, kLook);
}

TEST_F(Live, IsSilentWhileSamplesComeTooLate) {
  motion_.sensor.latency = 0.2;
  const PlayReport played = play_it();
  ASSERT_TRUE(ended(*loop_, time_));
  EXPECT_EQ(played.sent, 0U);
  EXPECT_GE(played.stale, 15U);
  EXPECT_THAT(link_.frames(), IsEmpty());
}

// The solver goes on with what was seen last, for as long as that may be felt.
TEST_F(Live, IsSilentWhenTheSensorHangs) {
  sensing_ = [this](double seconds) {
    if (seconds > 0.39) pass(kForEver);
  };
  const PlayReport played = play_it();
  const double last = asked_.back().sample.now.state.numbers(0);
  EXPECT_NEAR(last, 11 / 30.0, 1e-6);
  EXPECT_EQ(played.silences, 1U);
  EXPECT_TRUE(link_.on_at(last + 0.15 - 1e-4));
  EXPECT_FALSE(link_.on_at(last + 0.15 + kLook));
  EXPECT_EQ(link_.frames().back(), 8);  // of 0.45; that of 0.5 comes too late
  EXPECT_GT(played.stale, 5U);
  EXPECT_FALSE(loop_->stop(0.02));
  EXPECT_TRUE(ended(*loop_, time_));
}

TEST_F(Live, IsSilentWhenTheSolverHangs) {
  solving_ = [this](std::size_t k, LiveSolution&) { pass(k < 5 ? 0.02 : kForEver); };
  const PlayReport played = play_it();
  const double seen = asked_[4].sample.now.state.numbers(0);  // of the last frame that came
  EXPECT_EQ(link_.frames().back(), 4);
  EXPECT_TRUE(link_.on_at(seen + 0.15 - 1e-4));
  EXPECT_FALSE(link_.on_at(seen + 0.15 + kLook));
  EXPECT_EQ(played.silences, 1U);
  EXPECT_NEAR(played.silent, 1 - seen - 0.15, 2 * kLook);
  EXPECT_EQ(link_.sent.back().number, -1);
  EXPECT_FALSE(loop_->over());
  EXPECT_FALSE(loop_->stop(0.02));
  EXPECT_TRUE(ended(*loop_, time_));
}

TEST_F(Live, ComesBackAfterASlowFrame) {
  solving_ = [this](std::size_t k, LiveSolution&) { pass(k == 3 ? 0.4 : 0.02); };
  const PlayReport played = play_it();
  ASSERT_TRUE(ended(*loop_, time_));
  EXPECT_EQ(played.silences, 1U);
  EXPECT_EQ(played.stale, 1U) << "the slow one itself";
  EXPECT_EQ(loop_->report().dropped, 7);  // of the slots from 0.25 to 0.6, all but the last
  EXPECT_THAT(link_.frames(), Not(Contains(3)));
  EXPECT_THAT(link_.frames(), ::testing::IsSupersetOf({2, 4, 5}));
  EXPECT_TRUE(link_.on_at(0.99));
}

TEST_F(Live, IsSilentWhereTheTargetHoldsNoSkin) {
  solving_ = [this](std::size_t k, LiveSolution& solution) {
    pass(0.02);
    solution.frame.silent = k >= 4 && k < 8;
    if (solution.frame.silent) solution.frame.solution.amplitudes.setZero();
  };
  play_it();
  EXPECT_TRUE(link_.on_at(0.265));
  for (double t = 0.272; t < 0.468; t += 0.01) EXPECT_FALSE(link_.on_at(t)) << t;
  EXPECT_TRUE(link_.on_at(0.475));
}

TEST_F(Live, IsSilentWhenTheSolverThrows) {
  solving_ = [this](std::size_t k, LiveSolution&) {
    pass(0.02);
    if (k == 6) throw NumericalError("singular");
  };
  const PlayReport played = play_it();
  EXPECT_FALSE(played.stopped);
  EXPECT_EQ(link_.sent.back().number, -1);
  EXPECT_NEAR(link_.sent.back().at, 0.37, kLook);
  EXPECT_EQ(link_.frames().back(), 5);
  EXPECT_TRUE(ended(*loop_, time_));
  EXPECT_THROW(loop_->rethrow(), NumericalError);
  EXPECT_EQ(loop_->report().frames.size(), 6U);
}

TEST_F(Live, IsSilentWhenTheSensorThrows) {
  sensing_ = [](double seconds) {
    if (seconds > 0.5) throw IoError("no camera");
  };
  play_it();
  EXPECT_LT(link_.sent.back().at, 0.54);
  EXPECT_EQ(link_.sent.back().number, -1);
  EXPECT_THROW(loop_->rethrow(), IoError);
}

TEST_F(Live, EndsWithALostLink) {
  link_.lost_at = 4;
  EXPECT_THROW(play_it(), DeviceError);
  EXPECT_TRUE(ended(*loop_, time_));
}

TEST_F(Live, ThrowsWhatThePreparationThrew) {
  const auto fails = []() -> LiveSolver { throw InputError("no such thing"); };
  LiveLoop loop(
      motion_, [](std::int64_t, double s) { return seen_at(s); }, fails, time_);
  EXPECT_THROW(while (!loop.ready(1)){}, InputError);
}

// The pose at the middle of the time that a frame will be shown, of what solving and handing over took so far.
class LivePrediction : public Live, public ::testing::WithParamInterface<MotionSpec::Prediction> {};
INSTANTIATE_TEST_SUITE_P(All, LivePrediction,
                         ::testing::Values(MotionSpec::Prediction::kLinear, MotionSpec::Prediction::kKalman));

TEST_P(LivePrediction, GoesByWhatIsMeasured) {
  motion_.predict = GetParam();
  motion_.array_delay = 2e-3;
  link_.busy = 4e-3;
  solving_ = [this](std::size_t k, LiveSolution&) { pass(k % 3 == 0 ? 0.03 : 0.02); };
  play_it();
  ASSERT_GE(asked_.size(), 15U);
  EXPECT_NEAR(asked_[0].wanted, asked_[0].at + 0.002 + 0.025, 1e-5) << "nothing is known yet";
  for (std::size_t k = 4; k < asked_.size(); ++k) {
    const double expected = asked_[k].at + 0.02 + 0.004 + 0.002 + 0.025;
    EXPECT_GE(asked_[k].wanted, expected - 1e-5);
    EXPECT_LE(asked_[k].wanted, expected + kLook);
    EXPECT_NEAR(asked_[k].sample.prediction.at(asked_[k].wanted).numbers(0), asked_[k].wanted, 1e-6);  // filters settle
  }
}

// On the machine's own clock, where threads run as they like.
class LiveOnTheWallClock : public ::testing::Test {
 protected:
  class WallPace final : public Pace {
   public:
    double now() override { return time.now(); }
    bool wait_until(double t) override {
      time.wait_until(t, {});
      return true;
    }
    SteadyTime time;
  };

  void play_it(LiveLoop& loop, const MotionSpec& motion, const Rounding& rounding) {
    while (!loop.ready(1)) {
    }
    PlayReport played;
    play(stream_of(loop, motion, rounding), link_, motion.seconds, pace_, played);
    EXPECT_EQ(link_.sent.back().number, -1);
    ASSERT_TRUE(loop.stop(60));
    const LiveReport report = loop.report();
    EXPECT_GE(played.sent, 1U);
    EXPECT_GE(report.frames.size(), played.sent);
    double before = 0;
    for (std::size_t k = 0; k < report.frames.size(); ++k) {
      const MotionFrame& frame = report.frames[k];
      EXPECT_GE(frame.sampled, before);
      EXPECT_GE(frame.started, frame.sampled + motion.sensor.latency - 1e-5);
      EXPECT_GE(report.solved[k], frame.started);
      before = frame.sampled;
    }
  }

  WallPace pace_;
  NotingLink link_{pace_};
};

TEST_F(LiveOnTheWallClock, GoesThroughItsMotion) {
  MotionSpec motion = motion_of(0.5);
  motion.frames_hz = 1000;
  motion.sensor.hz = 1300;
  motion.predict = MotionSpec::Prediction::kLinear;
  motion.stale = 10;
  std::size_t solved = 0;
  LiveLoop loop(
      motion, [](std::int64_t, double s) { return seen_at(s); },
      [&] { return [&](const LiveSample&, double) { return solution_of(solved++ % 256); }; }, pace_.time);
  play_it(loop, motion, rounded);
}

class LiveScene : public LiveOnTheWallClock {
 protected:
  const MovingModel moving_{scene_from(kMovingCapsule, {"array.grid.count=[6, 5]", "solve.methods=[surface]",
                                                        "motion.predict=linear", "motion.stale_ms=10000"})};
  /// How far the costs of two frames are apart, relatively; single precision rounds differently by how memory lies, and
  /// phases that matter little follow that.
  static double apart(const MotionFrame& a, const MotionFrame& b) {
    return std::abs(a.solution.cost_history.back() / b.solution.cost_history.back() - 1.0);
  }

  ExactSensor sensor_{moving_};
  const MethodSpec& method_ = moving_.first().fixed->scene.solve.methods.front();
  LiveSolution first_;
};

// The motion is straight, so that the pose expected is the true one.
TEST_F(LiveScene, IsSolvedForThePoseThatIsExpected) {
  const LiveSolver solver = live_solver(sensor_, method_, first_);
  FrameSolver reference(moving_, method_, drives_for(sensor_, method_));
  EXPECT_LT(apart(first_.frame, reference.solve(moving_.first())), 1e-3);
  LiveSample sample{{0.1, moving_.state(0.1)}, MotionPrediction(MotionSpec::Prediction::kLinear)};
  sample.prediction.see({0.06, moving_.state(0.06)});
  sample.prediction.see(sample.now);
  for (const double wanted : {0.1, 0.17}) {
    const LiveSolution found = solver(sample, wanted);
    const MotionFrame expected = reference.solve(moving_.at(moving_.state(wanted)));
    EXPECT_LT(apart(found.frame, expected), 1e-3);
    EXPECT_EQ(found.frame.seconds.front().first, "pose");
    EXPECT_NEAR(found.residual, reference.worst_residual(), 0.1 * reference.worst_residual());
  }
}

// The fit's model of the hand is carried on in one thread while phases are found on it in the other.
TEST_F(LiveOnTheWallClock, AHandIsFittedBesideTheSolver) {
  const Scene scene = scene_from(
      "name: seen\n"
      "array: {grid: {count: [6, 5], pitch_mm: 10.16}}\n"
      "body: {hand: {pose: index_up}, place: {landmark: index_pad, at_mm: [0, 0, 200]}, edge_mm: 6, keep_within_mm: "
      "22}\n"
      "target: {box: {at: index_pad, size_mm: [8, 8, 6]}, pressure_pa: 500}\n"
      "solve: {methods: [surface], scheme: paper_corrected, allow_coarse_mesh: true}\n"
      "motion:\n"
      "  seconds: 0.5\n"
      "  stale_ms: 10000\n"
      "  sensor:\n"
      "    hz: 10\n"
      "    cameras:\n"
      "      - {at_mm: [280, -50, 0], look_at_mm: [0, -50, 215], resolution: [320, 180]}\n"
      "      - {at_mm: [-280, -50, 0], look_at_mm: [0, -50, 215], resolution: [320, 180]}\n");
  const SensedMotion sensed = sensed_motion(scene);
  Progress silent;
  sensed.sensor->start(silent);
  LiveSolution first;
  LiveLoop loop(
      *scene.motion, [&](std::int64_t number, double seconds) { return sensed.sensor->sample(number, seconds); },
      [&] { return live_solver(*sensed.sensor, scene.solve.methods.front(), first); }, pace_.time);
  play_it(loop, *scene.motion, [](const Drive&) { return DriveFrame{{1}, {255}}; });
  EXPECT_FALSE(loop.report().frames.front().lost);
}

}  // namespace touchfield::live_test
