#include "sim/core/atomic_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <dirent.h>
#include <fcntl.h>
#include <filesystem>
#include <set>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
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
      make();
    } while (!hold());
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
      if (written < 0 && errno == EACCES && locked_) {  // SMB: a shared lock forbids its own holder to write
        ::flock(file_.number(), LOCK_UN);
        locked_ = false;
        continue;
      }
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
  void make() {
    do {
      temporary_ = target_.parent_path() /
                   fmt::format(".{}{}{:0{}x}", target_.filename().string(), kMark, random_number(), kDigits);
      // Read too: a network file system locks for a reader only what may be read.
      file_ = Descriptor(::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666));
    } while (file_.number() < 0 && errno == EEXIST);
    if (file_.number() < 0) {
      fail();
    }
  }

  /// Marks the file as that of a living process, until it is closed under its own name. Shared, so that nobody who
  /// reads it there, as HDF5 does under a shared lock, is refused. False if remove_leftovers was quicker.
  bool hold() {
    struct stat about {};
    locked_ = ::flock(file_.number(), LOCK_SH | LOCK_NB) == 0;
    const bool refused = !locked_ && errno == EWOULDBLOCK;
    return !refused && (::lstat(temporary_.c_str(), &about) == 0 || errno != ENOENT);
  }

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
  Descriptor file_;
  bool locked_ = false;
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

void remove_leftovers(const Descriptor& directory, const std::function<bool(const std::string&)>& is_own,
                      bool even_living) {
  const int copy = ::openat(directory.number(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  DIR* const listed = copy >= 0 ? ::fdopendir(copy) : nullptr;
  if (listed == nullptr) {
    if (copy >= 0) {
      ::close(copy);
    }
    return;
  }
  while (const dirent* entry = ::readdir(listed)) {
    const auto target = target_of_temporary(entry->d_name);
    if (!target || !is_own(*target)) {
      continue;
    }
    const Descriptor file(::openat(directory.number(), entry->d_name, O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (file.number() >= 0 && (even_living || ::flock(file.number(), LOCK_EX | LOCK_NB) == 0)) {
      ::unlinkat(directory.number(), entry->d_name, 0);
    }
  }
  ::closedir(listed);
}

void remove_leftovers_of(const std::vector<std::string>& paths) {
  std::set<std::string> names;
  std::filesystem::path folder;
  for (const std::string& path : paths) {
    const std::filesystem::path file(path);
    names.insert(file.filename().string());
    folder = file.has_parent_path() ? file.parent_path() : ".";
  }
  remove_leftovers(Descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)),
                   [&](const std::string& name) { return names.contains(name); });
}

}  // namespace touchfield
