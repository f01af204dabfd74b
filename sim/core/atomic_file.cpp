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

#include "sim/core/child_process.h"

namespace touchfield {

namespace {

constexpr std::string_view kMark = ".tmp-";
constexpr std::size_t kDigits = 16;

/// A file under its temporary name; gone again unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    do {
      std::uint64_t number = 0;
      if (::getrandom(&number, sizeof number, 0) != sizeof number) {
        fail();
      }
      temporary_ =
          target_.parent_path() / fmt::format(".{}{}{:0{}x}", target_.filename().string(), kMark, number, kDigits);
      file_ = Descriptor(::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
    } while (file_.number() < 0 && errno == EEXIST);
    if (file_.number() < 0) {
      fail();
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (!renamed_) {
      ::unlink(temporary_.c_str());
    }
  }

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(file_.number(), bytes.data(), std::min(bytes.size(), kLargestWrite));
      if (written < 0 && errno != EINTR) {
        fail();
      }
      bytes.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
    }
  }

  void commit() {
    if (::fsync(file_.number()) != 0 || ::rename(temporary_.c_str(), target_.c_str()) != 0) {
      fail();
    }
    renamed_ = true;
  }

 private:
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
  Descriptor file_;
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

std::optional<std::string> target_of_temporary(std::string_view name) {
  const std::size_t end = kMark.size() + kDigits;
  if (!name.starts_with('.') || name.size() < 2 + end || name.substr(name.size() - end, kMark.size()) != kMark ||
      name.find_first_not_of("0123456789abcdef", name.size() - kDigits) != std::string_view::npos) {
    return std::nullopt;
  }
  return std::string(name.substr(1, name.size() - 1 - end));
}

}  // namespace touchfield
