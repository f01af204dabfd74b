#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/command_line.h"
#include "sim/core/files.h"
#include "sim/core/progress.h"

namespace touchfield {

/// "12 s", "34 min", "5.6 h"
std::string span_text(double seconds);

/// Shows progress to a person on standard error: a bar on a terminal, plain lines elsewhere. Every line also goes to a
/// log file if there is one. The bar is that of the stage, or of all work if its duration is known. Details and stages
/// of less than half a second are for the log alone, unless the user asks for all.
///
/// A stage that lasts reports how far it is and how long it still takes. These reports go to the log and, if there is
/// no terminal, to standard error. The first comes after 2 s. Each later interval is twice as long as the one before,
/// but at most a minute.
class ConsoleProgress : public Progress {
 public:
  explicit ConsoleProgress(const CommonFlags& flags);
  ~ConsoleProgress() override;

  /// How long everything from now on is expected to take [s]: bars then show how much of that has passed.
  void expect(double seconds);

  /// From now on every line also goes to this file.
  /// throws   as LogFile
  void log_to(const std::string& path);

  void begin(std::string_view what) override;
  void advance(double fraction) override;
  void end(double seconds) override;
  void note(std::string_view line) override;
  void detail(std::string_view line) override;
  void remark(std::string_view message) override;
  void warn(std::string_view message) override;

 private:
  using Clock = std::chrono::steady_clock;
  struct Stage {
    std::string what;
    Clock::time_point begun;
    Clock::time_point next;  // when a line is due
    Clock::duration wait;    // until the one after that
  };

  void clear_bar();
  void tell(bool shown, const char* begin, std::string_view line);
  void draw_bar(int percent, const std::string& left);
  void draw_total(Clock::time_point now);
  void write_line(const std::string& line);

  bool terse_;  // warnings only
  bool verbose_;
  bool terminal_;
  bool bar_shown_ = false;
  int shown_percent_ = -1;
  Clock::time_point drawn_;
  std::vector<Stage> stages_;  // begun and not ended, one within another
  std::optional<LogFile> log_;
  std::optional<Clock::time_point> expected_since_;
  double expected_ = 0.0;  // [s]
};

}  // namespace touchfield
