#include "apps/commands/console_progress.h"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <unistd.h>

#include <fmt/format.h>

#include "apps/commands/standard_streams.h"

namespace touchfield {

ConsoleProgress::ConsoleProgress(bool quiet) : quiet_(quiet), terminal_(isatty(fileno(stderr)) == 1) {}

ConsoleProgress::~ConsoleProgress() { clear_bar(); }

void ConsoleProgress::log_to(const std::string& path) { log_.emplace(path); }

void ConsoleProgress::begin(std::string_view what) {
  stages_.emplace_back(what);
  shown_percent_ = -1;
  if (terminal_ && !quiet_) {
    clear_line();
    say(fmt::format("  {} ...", stages_.back()));
    bar_shown_ = true;
  }
}

void ConsoleProgress::advance(double fraction) {
  const int percent = static_cast<int>(100.0 * std::clamp(fraction, 0.0, 1.0));
  if (!terminal_ || quiet_ || percent == shown_percent_ || stages_.empty()) {
    return;
  }
  shown_percent_ = percent;
  constexpr int kWidth = 24;
  const int full = percent * kWidth / 100;
  clear_line();
  say(fmt::format("  {} [{}{}] {:3d} %", stages_.back(), std::string(static_cast<std::size_t>(full), '#'),
                  std::string(static_cast<std::size_t>(kWidth - full), '.'), percent));
  bar_shown_ = true;
}

void ConsoleProgress::end(double seconds) {
  note(fmt::format("  {}: {:.2f} s", stages_.back(), seconds));
  stages_.pop_back();
}

void ConsoleProgress::remark(std::string_view message) {
  clear_bar();
  if (!quiet_) {
    say(fmt::format("touchfield: note: {}\n", message));
  }
  if (log_) {
    log_->line(fmt::format("note: {}", message));
  }
}

void ConsoleProgress::warn(std::string_view message) {
  clear_bar();
  say(fmt::format("touchfield: warning: {}\n", message));
  if (log_) {
    log_->line(fmt::format("warning: {}", message));
  }
}

void ConsoleProgress::note(std::string_view line) {
  clear_bar();
  if (!quiet_) {
    say(fmt::format("{}\n", line));
  }
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
