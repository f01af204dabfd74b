#include "sim/core/files.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr std::string_view kMark = ".tmp-";
constexpr std::size_t kDigits = 16;

/// "a link", "a folder", ..: what has this name and is not a regular file; empty if nothing has.
std::string other_than_file(const std::filesystem::path& path) {
  std::error_code error;
  switch (std::filesystem::symlink_status(path, error).type()) {
    case std::filesystem::file_type::none:
    case std::filesystem::file_type::not_found:
    case std::filesystem::file_type::regular:
      return "";
    case std::filesystem::file_type::symlink:
      return "a link";
    case std::filesystem::file_type::directory:
      return "a folder";
    case std::filesystem::file_type::fifo:
      return "a pipe";
    case std::filesystem::file_type::socket:
      return "a socket";
    default:
      return "a device";
  }
}

/// A file under its temporary name; gone again unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : target_(target) {
    if (const std::string other = other_than_file(target); !other.empty()) {
      throw IoError(fmt::format("{}: cannot write: it is {}, and only files are replaced", target.string(), other));
    }
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

void require_free(const std::string& path, bool force, const std::string& remedy) {
  if (const std::string other = other_than_file(path); !other.empty()) {
    throw InputError(fmt::format("{}: is {}, and only files are replaced; give another name", path, other));
  }
  std::error_code error;
  if (!force && std::filesystem::exists(path, error)) {
    throw InputError(fmt::format("{}: the file exists; {}", path, remedy));
  }
}

std::optional<std::string> target_of_temporary(std::string_view name) {
  const std::size_t end = kMark.size() + kDigits;
  if (!name.starts_with('.') || name.size() < 2 + end || name.substr(name.size() - end, kMark.size()) != kMark ||
      name.find_first_not_of("0123456789abcdef", name.size() - kDigits) != std::string_view::npos) {
    return std::nullopt;
  }
  return std::string(name.substr(1, name.size() - 1 - end));
}

std::string read_whole_file(const std::string& path, std::size_t most) {
  const auto refuse = [&](const std::string& what) { throw InputError(fmt::format("{}: {}", path, what)); };
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    refuse("a directory, must be a file");
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  constexpr std::size_t kBlock = 1U << 20U;
  std::string bytes;
  while (file) {
    const std::size_t size = bytes.size();
    bytes.resize(size + std::min(kBlock, most + 1 - size));
    file.read(bytes.data() + size, static_cast<std::streamsize>(bytes.size() - size));
    bytes.resize(size + static_cast<std::size_t>(file.gcount()));
    if (bytes.size() > most) {
      refuse(fmt::format("too long, must be at most {} bytes", most));
    }
  }
  if (!file.eof()) {
    refuse(errno == ENOENT ? "no such file" : fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  return bytes;
}

std::string read_text_file(const std::string& path, std::size_t most) {
  std::string text = read_whole_file(path, most);
  require_text(text, path);
  text.erase(0, text.starts_with("\xEF\xBB\xBF") ? 3 : 0);
  return text;
}

FileLock::FileLock(const std::string& path, bool is_folder) {
  struct stat own {};
  struct stat named {};
  do {  // between opening and locking, its name may have gone to another
    const bool made = !is_folder || ::mkdir(path.c_str(), 0777) == 0 || errno == EEXIST;
    const int why_not = errno;
    const int how = is_folder ? O_RDONLY | O_DIRECTORY : O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK;
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
