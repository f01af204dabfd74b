#pragma once

#include <string>
#include <string_view>

#include "sim/core/child_process.h"

namespace touchfield {

/// A log: lines, each with the time it was written, in the file at once.
class LogFile {
 public:
  /// Makes the file; nothing of that name, be it a link, is written to.
  /// throws   IoError if it cannot be made
  explicit LogFile(const std::string& path);

  /// What finds no room is left out: a log is no part of a result.
  void line(std::string_view text);

 private:
  Descriptor file_;
};

}  // namespace touchfield
