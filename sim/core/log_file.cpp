#include "sim/core/log_file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/version.h"

namespace touchfield {

LogFile::LogFile(const std::string& path)
    : file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_APPEND | O_CLOEXEC, 0666)) {
  if (file_.number() < 0) {
    throw IoError(fmt::format("{} cannot be written: {}", path, std::strerror(errno)));
  }
}

void LogFile::line(std::string_view text) {
  const std::string line = fmt::format("{} {}\n", utc_now(), text);
  static_cast<void>(::write(file_.number(), line.data(), line.size()) < 0);  // in one call: threads' lines stay apart
}

}  // namespace touchfield
