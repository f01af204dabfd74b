#include "sim/batch/file_progress.h"

#include <fmt/format.h>

#include "sim/core/version.h"

namespace touchfield {

void FileProgress::end(double seconds) {
  note(fmt::format("  {}: {:.2f} s", stages_.back(), seconds));
  stages_.pop_back();
}

void FileProgress::note(std::string_view line) { log_ << utc_now() << ' ' << line << std::endl; }

void FileProgress::warn(std::string_view message) { note(fmt::format("warning: {}", message)); }

}  // namespace touchfield
