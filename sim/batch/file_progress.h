#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "sim/core/progress.h"

namespace touchfield {

/// Writes what a computation does into a log, a line a stage, each with the time and on the disk at once.
class FileProgress : public Progress {
 public:
  /// A file that cannot be opened leaves the log empty: it is no part of the result.
  explicit FileProgress(const std::string& path) : log_(path) {}

  void begin(std::string_view what) override { stages_.emplace_back(what); }
  void end(double seconds) override;
  void note(std::string_view line) override;
  void warn(std::string_view message) override;

 private:
  std::ofstream log_;
  std::vector<std::string> stages_;  // begun and not ended, one within another
};

}  // namespace touchfield
