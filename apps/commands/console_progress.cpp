#include "apps/commands/console_progress.h"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <unistd.h>

#include <fmt/format.h>

#include "apps/commands/standard_streams.h"

namespace touchfield {

namespace {

constexpr std::chrono::seconds kFirstLine{2};
constexpr std::chrono::seconds kLongestWait{60};
constexpr double kBrief = 0.5;              // seconds of a stage that the log alone has
constexpr std::chrono::seconds kRedraw{1};  // of a bar that stands still: the time that is left does not

}  // namespace

std::string span_text(double seconds) {
  if (seconds < 100) {
    return fmt::format("{:.0f} s", seconds);
  }
  return seconds < 6000 ? fmt::format("{:.0f} min", seconds / 60) : fmt::format("{:.1f} h", seconds / 3600);
}

ConsoleProgress::ConsoleProgress(const CommonFlags& flags)
    : terse_(flags.quiet || flags.json), verbose_(flags.verbose && !terse_), terminal_(isatty(fileno(stderr)) == 1) {}

ConsoleProgress::~ConsoleProgress() { clear_bar(); }

void ConsoleProgress::expect(double seconds) {
  expected_ = seconds;
  expected_since_ = Clock::now();
}

void ConsoleProgress::log_to(const std::string& path) { log_.emplace(path); }

void ConsoleProgress::begin(std::string_view what) {
  const auto now = Clock::now();
  stages_.push_back({std::string(what), now, now + kFirstLine, kFirstLine});
  shown_percent_ = -1;
  if (terminal_ && !terse_) {
    if (expected_since_) {
      draw_total(now);
    } else {
      clear_line();
      say(fmt::format("  {} ...", stages_.back().what));
    }
    bar_shown_ = true;
  }
}

void ConsoleProgress::advance(double fraction) {
  if (stages_.empty()) {
    return;
  }
  Stage& stage = stages_.back();
  const double share = std::clamp(fraction, 0.0, 1.0);
  const int percent = static_cast<int>(100.0 * share);
  const auto now = Clock::now();
  const double taken = std::chrono::duration<double>(now - stage.begun).count();
  const std::string left =
      share > 0 && share < 1 && taken > 1 ? ", about " + span_text(taken * (1 / share - 1)) + " left" : "";
  if (terminal_ && !terse_ && (percent != shown_percent_ || now - drawn_ > kRedraw)) {
    drawn_ = now;
    shown_percent_ = percent;
    if (expected_since_) {
      draw_total(now);
    } else {
      draw_bar(percent, left);
    }
  }
  if (now >= stage.next && share < 1) {
    stage.wait = std::min<Clock::duration>(2 * stage.wait, kLongestWait);
    stage.next = now + stage.wait;
    const std::string far = share < 0.1 ? fmt::format("{:.2g}", 100 * share) : std::to_string(percent);
    write_line(fmt::format("  {}: {} %{}", stage.what, far, left));
  }
}

/// Into the log, and to where no bar shows it.
void ConsoleProgress::write_line(const std::string& line) {
  if (!terminal_ && !terse_) {
    say(line + "\n");
  }
  if (log_) {
    log_->line(line);
  }
}

/// Of everything: by the time that has passed, as stages differ in what a share of them takes.
void ConsoleProgress::draw_total(Clock::time_point now) {
  constexpr double kMost = 0.99;  // before it is finished
  const double passed = std::chrono::duration<double>(now - *expected_since_).count();
  const double left = expected_ - passed;
  draw_bar(static_cast<int>(100.0 * std::min(passed / std::max(expected_, 1e-3), kMost)),
           left > 0 ? fmt::format(", about {} left", span_text(left)) : ", longer than expected");
}

void ConsoleProgress::draw_bar(int percent, const std::string& left) {
  constexpr int kWidth = 24;
  const int full = percent * kWidth / 100;
  clear_line();
  say(fmt::format("  [{}{}] {:3d} %{}: {}", std::string(static_cast<std::size_t>(full), '#'),
                  std::string(static_cast<std::size_t>(kWidth - full), '.'), percent, left, stages_.back().what));
  bar_shown_ = true;
}

void ConsoleProgress::end(double seconds) {
  const std::string line = fmt::format("  {}: {:.{}f} s", stages_.back().what, seconds, seconds < 10 ? 2 : 0);
  stages_.pop_back();
  if (seconds < kBrief) {
    detail(line);
  } else {
    note(line);
  }
}

void ConsoleProgress::tell(bool shown, const char* begin, std::string_view line) {
  clear_bar();
  if (shown) {
    say(fmt::format("{}{}\n", begin, line));
  }
  if (log_) {
    log_->line(line);
  }
}

void ConsoleProgress::remark(std::string_view message) {
  tell(!terse_, "touchfield: ", fmt::format("note: {}", message));
}

void ConsoleProgress::warn(std::string_view message) {
  tell(true, "touchfield: ", fmt::format("warning: {}", message));
}

void ConsoleProgress::note(std::string_view line) { tell(!terse_, "", line); }

void ConsoleProgress::detail(std::string_view line) {
  if (verbose_) {
    note(line);
    return;
  }
  clear_bar();
  if (log_) {
    log_->line(line);
  }
}

void ConsoleProgress::clear_bar() {
  if (bar_shown_) {
    clear_line();
    bar_shown_ = false;
  }
}

}  // namespace touchfield
