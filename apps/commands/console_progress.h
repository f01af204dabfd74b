#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/log_file.h"
#include "sim/core/progress.h"

namespace touchfield {

/// Shows progress to a person on standard error, a bar on a terminal and plain lines elsewhere, and keeps every line in
/// a log file if there is one.
class ConsoleProgress : public Progress {
 public:
  /// quiet   show warnings only
  explicit ConsoleProgress(bool quiet);
  ~ConsoleProgress() override;

  /// From now on every line also goes to this file.
  /// throws   as LogFile
  void log_to(const std::string& path);

  void begin(std::string_view what) override;
  void advance(double fraction) override;
  void end(double seconds) override;
  void note(std::string_view line) override;
  void remark(std::string_view message) override;
  void warn(std::string_view message) override;

 private:
  void clear_bar();

  bool quiet_;
  bool terminal_;
  bool bar_shown_ = false;
  int shown_percent_ = -1;
  std::vector<std::string> stages_;  // begun and not ended, one within another
  std::optional<LogFile> log_;
};

}  // namespace touchfield
