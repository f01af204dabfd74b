#include "hardware/player.h"

#include <numeric>

#include "tests/support/testing.h"

namespace touchfield::player_test {

/// A clock that only waiting, and whoever says that he took time, moves on.
class FakePace final : public Pace {
 public:
  double now() override { return time_; }
  bool wait_until(double t) override {
    time_ = std::max(time_, t);
    return time_ < stop_at_;
  }
  void pass(double seconds) { time_ += seconds; }
  void stop_at(double t) { stop_at_ = t; }

 private:
  double time_ = 100;  // of no meaning
  double stop_at_ = 1e9;
};

/// Notes what it is sent and when; takes a time of choice for it.
class NotingLink : public ArrayLink {
 public:
  explicit NotingLink(FakePace& pace) : pace_(pace) {}

  std::string describe() const override { return "noting link"; }
  const ArrayLayout& layout() const override { return layout_; }
  LinkAbilities abilities() const override { return {{256, 256}, 50, {}}; }
  void open() override {}
  void set_modulation(const Modulation&) override {}
  void send(const DriveFrame& frame) override {
    numbers.push_back(frame.phase[0]);
    times.push_back(pace_.now() - 100);
    pace_.pass(busy);
  }
  void check() override {
    if (++checks == lost_at) throw DeviceError("lost");
  }
  void silence() override { ++silenced; }
  void close() noexcept override {}

  std::vector<int> numbers;
  std::vector<double> times;
  double busy = 0;  // [s] that a frame takes
  int checks = 0;
  int silenced = 0;
  int lost_at = -1;

 private:
  FakePace& pace_;
  ArrayLayout layout_ = grid_layout(1, 1, 0.01);
};

/// Notes what it is to store and to play.
class StoringLink final : public NotingLink {
 public:
  using NotingLink::NotingLink;
  LinkAbilities abilities() const override {
    LinkAbilities can = NotingLink::abilities();
    can.stored = {40, 40e3, 40, 65535};
    return can;
  }
  void store(std::size_t first, const std::vector<DriveFrame>& frames) override {
    EXPECT_EQ(first, stored.size());
    EXPECT_LE(frames.size(), kStoredAtOnce);
    for (const DriveFrame& frame : frames) stored.push_back(frame.phase[0]);
  }
  void play_stored(std::size_t count, double rate) override { plays.emplace_back(count, rate); }

  std::vector<int> stored;
  std::vector<std::pair<std::size_t, double>> plays;
};

DriveFrame numbered(std::size_t n) { return {{static_cast<std::uint8_t>(n)}, {255}}; }

PlayReport played(std::size_t count, const FrameSource& source, ArrayLink& link, const PlayOptions& options,
                  Pace& pace) {
  PlayReport report;
  play(count, source, link, options, pace, report);
  return report;
}

PlayReport played(const FrameStream& stream, ArrayLink& link, double seconds, Pace& pace) {
  PlayReport report;
  play(stream, link, seconds, pace, report);
  return report;
}

class Player : public testing::Test {
 protected:
  FakePace pace_;
  NotingLink link_{pace_};
};

TEST_F(Player, SendsEachFrameInItsTime) {
  const PlayReport report = played(4, numbered, link_, {10, 0.4, false}, pace_);
  EXPECT_THAT(link_.numbers, ElementsAre(0, 1, 2, 3));
  for (std::size_t n = 0; n < 4; ++n) EXPECT_NEAR(link_.times[n], 0.1 * static_cast<double>(n), 1e-6);
  EXPECT_EQ(report.sent, 4U);
  EXPECT_EQ(report.dropped, 0U);
  EXPECT_EQ(report.late, 0U);
  EXPECT_NEAR(report.seconds, 0.4, 1e-9);
  EXPECT_FALSE(report.stopped);
}

// A frame takes 2.5 periods: of every three or so one is sent, the newest, and never one that is overtaken.
TEST_F(Player, ASlowDeviceDropsFramesAndMakesNoQueue) {
  link_.busy = 0.25;
  const PlayReport report = played(100, numbered, link_, {10, 1.0, false}, pace_);
  EXPECT_THAT(link_.numbers, ElementsAre(0, 2, 5, 7));
  EXPECT_EQ(report.dropped, 1U + 2U + 1U);
  for (std::size_t k = 0; k < link_.numbers.size(); ++k) {
    EXPECT_NEAR(link_.times[k], 0.1 * link_.numbers[k], 0.1) << "a frame older than a period";
  }
}

// A source that takes 0.16 s for a frame of 0.1 s: what it makes is sent late, and what was due meanwhile drops out.
TEST_F(Player, ASlowSourceIsLate) {
  const auto slow = [&](std::size_t n) {
    pace_.pass(0.16);
    return numbered(n);
  };
  const PlayReport report = played(6, slow, link_, {10, 1.0, false}, pace_);
  // Asked for at 0, 0.16, 0.32, 0.48, 0.64: the newest due then.
  EXPECT_THAT(link_.numbers, ElementsAre(0, 1, 3, 4, 5));
  EXPECT_EQ(report.dropped, 1U);
  EXPECT_EQ(report.late, 5U);
  EXPECT_NEAR(report.worst_delay, 0.3, 1e-9);  // number 5 was due at 0.5, is asked for at 0.64 and there at 0.8
}

TEST_F(Player, TheLastFrameIsAlwaysSent) {
  link_.busy = 0.35;
  played(4, numbered, link_, {10, 2.0, false}, pace_);
  EXPECT_THAT(link_.numbers, ElementsAre(0, 3));
}

TEST_F(Player, HoldsTheLastFrameAndWatchesTheDevice) {
  played(1, numbered, link_, {10, 1.0, false}, pace_);
  EXPECT_THAT(link_.numbers, ElementsAre(0));
  EXPECT_GE(link_.checks, 10);
  link_.lost_at = link_.checks + 3;
  EXPECT_THROW(played(1, numbered, link_, {10, 1.0, false}, pace_), DeviceError);
}

TEST_F(Player, TellsWhatWasDoneUntilTheDeviceWasLost) {
  link_.lost_at = 3;  // half way to the third frame, or so
  PlayReport report;
  EXPECT_THROW(play(9, numbered, link_, {5, 1.8, false}, pace_, report), DeviceError);
  EXPECT_EQ(report.sent, link_.numbers.size());
  EXPECT_GT(report.sent, 0U);
  EXPECT_GT(report.seconds, 0);
  EXPECT_LE(report.seconds, 0.4);
}

TEST_F(Player, Repeats) {
  played(3, numbered, link_, {10, 0.75, true}, pace_);
  EXPECT_THAT(link_.numbers, ElementsAre(0, 1, 2, 0, 1, 2, 0, 1));
}

TEST_F(Player, IsStopped) {
  pace_.stop_at(100.25);
  const PlayReport report = played(100, numbered, link_, {10, 5, false}, pace_);
  EXPECT_TRUE(report.stopped);
  EXPECT_THAT(link_.numbers, ElementsAre(0, 1, 2));
}

/// A stream that has a new frame whenever it is asked, of what was seen `age` ago.
class Stream : public Player {
 protected:
  FrameStream stream() {
    return {.begin = [&](double now) { begun_ = now; },
            .newest = [&]() -> std::optional<StreamFrame> {
              if (asked_ == last_) throw InputError("no frame");
              const std::size_t number = asked_++;
              return StreamFrame{number, pace_.now() - age_, numbered(number)};
            },
            .committed = [&](std::size_t number, double at) { committed_.emplace_back(number, at); },
            .over = [&] { return asked_ == over_; },
            .stale = 0.15};
  }

  double begun_ = 0;
  double age_ = 0;
  std::size_t asked_ = 0;
  std::size_t last_ = 1'000'000;
  std::size_t over_ = 1'000'000;
  std::vector<std::pair<std::size_t, double>> committed_;
};

// The link takes 50 a second: it is not asked for more.
TEST_F(Stream, KeepsWithinTheLink) {
  link_.busy = 0.004;
  const PlayReport report = played(stream(), link_, 0.999, pace_);
  EXPECT_EQ(begun_, 100);
  EXPECT_EQ(report.sent, link_.numbers.size());
  EXPECT_GE(report.sent, 40U);
  EXPECT_LE(report.sent, 50U);
  for (std::size_t k = 1; k < link_.times.size(); ++k) EXPECT_GE(link_.times[k] - link_.times[k - 1], 0.02 - 1e-9);
  ASSERT_EQ(committed_.size(), report.sent);
  EXPECT_NEAR(committed_[3].second, 100 + link_.times[3] + 0.004, 1e-9);
  EXPECT_EQ(committed_[3].first, 3U);
  EXPECT_EQ(link_.silenced, 1);
}

TEST_F(Stream, SendsNothingThatIsTooOld) {
  age_ = 0.151;
  const PlayReport report = played(stream(), link_, 1, pace_);
  EXPECT_EQ(report.sent, 0U);
  EXPECT_GT(report.stale, 900U);
  EXPECT_THAT(link_.numbers, IsEmpty());
  EXPECT_GE(link_.checks, 19);
  EXPECT_EQ(link_.silenced, 1);
}

TEST_F(Stream, EndsWhenItIsOver) {
  over_ = 5;
  const PlayReport report = played(stream(), link_, 1, pace_);
  EXPECT_EQ(report.sent, 5U);
  EXPECT_LT(report.seconds, 0.2);
  EXPECT_EQ(link_.silenced, 1);
}

TEST_F(Stream, IsSilencedByAnError) {
  last_ = 5;
  EXPECT_THROW(played(stream(), link_, 1, pace_), InputError);
  EXPECT_EQ(link_.numbers.size(), 5U);
  EXPECT_EQ(link_.silenced, 1);
}

TEST(PlayStored, StoresAllThenPlaysAndLooksAfterIt) {
  FakePace pace;
  StoringLink link(pace);
  std::vector<DriveFrame> frames;
  for (std::size_t n = 0; n < 35; ++n) frames.push_back(numbered(n));
  PlayReport report;
  play_stored(frames, link, {.rate = 1000, .seconds = 2}, pace, report);
  std::vector<int> expected(35);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(link.stored, expected);
  EXPECT_THAT(link.plays, ElementsAre(std::pair<std::size_t, double>(35, 1000)));
  EXPECT_EQ(report.sent, 35);
  EXPECT_NEAR(report.seconds, 2, 1e-9);
  EXPECT_NEAR(link.checks, 40, 1);  // every 50 ms

  link.lost_at = link.checks + 3;
  link.stored.clear();
  EXPECT_THROW(play_stored(frames, link, {.rate = 1000, .seconds = 2}, pace, report), DeviceError);
}

TEST(PlayStored, WhatTheDeviceCannotDo) {
  FakePace pace;
  StoringLink link(pace);
  PlayReport report;
  const auto plays = [&](std::size_t count, double rate) {
    play_stored(std::vector<DriveFrame>(count, numbered(1)), link, {.rate = rate, .seconds = 1}, pace, report);
  };
  EXPECT_THROW(plays(1, 1000), InputError);
  EXPECT_THROW(plays(41, 1000), InputError);
  EXPECT_THROW(plays(2, 1001), InputError) << "40 kHz / 39.96";
  EXPECT_THROW(plays(2, 40e3 / 39), InputError) << "faster than the smoothing";
  EXPECT_TRUE(link.stored.empty());
  EXPECT_NO_THROW(plays(2, 40e3 / 41)) << "not a whole number of frames per second";
  NotingLink other(pace);
  EXPECT_THROW(play_stored({numbered(1), numbered(2)}, other, {.rate = 1000, .seconds = 1}, pace, report), InputError);
}

}  // namespace touchfield::player_test
