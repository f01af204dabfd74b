#include "sim/core/file_lock.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

FileLock::FileLock(const std::string& path, bool is_folder) {
  struct stat own {};
  struct stat named {};
  do {  // between opening and locking, its name may have gone to another
    const bool made = !is_folder || ::mkdir(path.c_str(), 0777) == 0 || errno == EEXIST;
    const int why_not = errno;
    const int how = is_folder ? O_RDONLY | O_DIRECTORY : O_RDWR | O_CREAT | O_NONBLOCK;
    file_ = Descriptor(::open(path.c_str(), how | O_CLOEXEC, 0666));
    if (file_.number() < 0 || ::fstat(file_.number(), &own) != 0) {
      throw IoError(
          fmt::format("{} cannot be {}: {}", path, made ? "opened" : "made", std::strerror(made ? errno : why_not)));
    }
    if (::flock(file_.number(), LOCK_EX | LOCK_NB) != 0) {
      state_ = errno == EWOULDBLOCK ? State::kElsewhere : State::kUnknown;
      return;
    }
    state_ = State::kHeld;
  } while (::stat(path.c_str(), &named) != 0 || own.st_dev != named.st_dev || own.st_ino != named.st_ino);
}

FileLock::~FileLock() {
  if (file_.number() >= 0 && state_ == State::kHeld) {
    ::flock(file_.number(), LOCK_UN);  // of copies of this process too
  }
}

}  // namespace touchfield
