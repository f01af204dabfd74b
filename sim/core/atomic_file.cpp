#include "sim/core/atomic_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/random.h>
#include <unistd.h>

#include <fmt/format.h>

namespace touchfield {

namespace {

constexpr std::string_view kMark = ".tmp-";
constexpr std::size_t kDigits = 16;

/// A file under its temporary name; gone again unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    do {
      temporary_ = target.parent_path() /
                   fmt::format(".{}{}{:0{}x}", target.filename().string(), kMark, random_number(), kDigits);
      descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) {
      fail();
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
    if (!renamed_) {
      ::unlink(temporary_.c_str());
    }
  }

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), std::min(bytes.size(), kLargestWrite));
      if (written < 0 && errno != EINTR) {
        fail();
      }
      bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
    }
  }

  void commit() {
    if (::fsync(descriptor_) != 0) {
      fail();
    }
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    if (closed != 0 || ::rename(temporary_.c_str(), target_.c_str()) != 0) {
      fail();
    }
    renamed_ = true;
  }

 private:
  std::uint64_t random_number() const {
    std::uint64_t number = 0;
    if (::getrandom(&number, sizeof number, 0) != sizeof number) {
      fail();
    }
    return number;
  }

  static constexpr std::size_t kLargestWrite = std::size_t{1} << 30;  // Linux moves less than 2 GiB in one call

  [[noreturn]] void fail() const {
    const int reason = errno;
    const std::string text =
        fmt::format("{}: cannot write{}: {}", target_.string(),
                    reason == EFBIG ? " beyond the limit on the size of files (ulimit -f)" : "", std::strerror(reason));
    if (reason == ENOSPC || reason == EDQUOT || reason == EFBIG) {
      throw NoRoomError(text);
    }
    throw IoError(text);
  }

  std::filesystem::path target_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

}  // namespace

void write_atomically(const std::string& path, std::initializer_list<std::string_view> parts) {
  TemporaryFile file{std::filesystem::path(path)};
  for (const std::string_view part : parts) {
    file.write(part);
  }
  file.commit();
}

bool is_leftover(std::string_view name, std::string_view target) {
  const std::string begin = fmt::format(".{}{}", target, kMark);
  return name.size() == begin.size() + kDigits && name.starts_with(begin) &&
         name.find_first_not_of("0123456789abcdef", begin.size()) == std::string_view::npos;
}

}  // namespace touchfield
