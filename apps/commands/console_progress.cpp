#include "apps/commands/console_progress.h"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <unistd.h>

#include <fmt/format.h>
#include <spdlog/sinks/basic_file_sink.h>

#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"

namespace touchfield {

ConsoleProgress::ConsoleProgress(bool quiet) : quiet_(quiet), terminal_(isatty(fileno(stderr)) == 1) {}

ConsoleProgress::~ConsoleProgress() { clear_bar(); }

void ConsoleProgress::log_to(const std::string& path) {
  try {
    log_ = std::make_shared<spdlog::logger>("run", std::make_shared<spdlog::sinks::basic_file_sink_mt>(path, true));
  } catch (const spdlog::spdlog_ex& error) {
    throw IoError(fmt::format("{} cannot be written: {}", path, error.what()));
  }
  log_->set_pattern("%Y-%m-%dT%H:%M:%S %v");
  log_->flush_on(spdlog::level::info);
}

void ConsoleProgress::begin(std::string_view what) {
  stages_.emplace_back(what);
  shown_percent_ = -1;
  if (terminal_ && !quiet_) {
    say(fmt::format("\r\033[K  {} ...", stages_.back()));
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
  say(fmt::format("\r\033[K  {} [{}{}] {:3d} %", stages_.back(), std::string(static_cast<std::size_t>(full), '#'),
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
    log_->info("note: {}", message);
  }
}

void ConsoleProgress::warn(std::string_view message) {
  clear_bar();
  say(fmt::format("touchfield: warning: {}\n", message));
  if (log_) {
    log_->warn("warning: {}", message);
  }
}

void ConsoleProgress::note(std::string_view line) {
  clear_bar();
  if (!quiet_) {
    say(fmt::format("{}\n", line));
  }
  if (log_) {
    log_->info("{}", line);
  }
}

void ConsoleProgress::clear_bar() {
  if (bar_shown_) {
    say("\r\033[K");
    bar_shown_ = false;
  }
}

}  // namespace touchfield
