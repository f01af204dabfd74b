#include "sim/core/own_directory.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string_view>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr int kAsFolder = O_RDONLY | O_DIRECTORY | O_CLOEXEC;

[[noreturn]] void refuse_directory(const std::string& path, const std::string& what) {
  throw InputError(fmt::format("output directory {}{}", path, what));
}

bool is_same(const struct stat& a, const struct stat& b) { return a.st_dev == b.st_dev && a.st_ino == b.st_ino; }

void take(int descriptor, const std::string& path, bool shared) {
  if (::flock(descriptor, (shared ? LOCK_SH : LOCK_EX) | LOCK_NB) == 0) {
    return;
  }
  const int reason = errno;
  if (reason == EWOULDBLOCK) {
    refuse_directory(path, ": another process works in it; wait for it, or give another directory with -o");
  }
  refuse_directory(path, fmt::format(" cannot be locked: {}", std::strerror(reason)));
}

Descriptor locked_file(int directory, const std::string& name, const std::string& path, bool shared) {
  Descriptor file(::openat(directory, name.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644));
  const int reason = errno;
  struct stat about {};
  if (reason == ELOOP && file.number() < 0) {
    refuse_directory(path, fmt::format(": its {} is a link, which is not followed; remove it", name));
  }
  if (file.number() < 0 || ::fstat(file.number(), &about) != 0) {
    refuse_directory(path, fmt::format(" cannot be written to: {}: {}", name, std::strerror(reason)));
  }
  if (!S_ISREG(about.st_mode)) {
    refuse_directory(path, fmt::format(": its {} is not a file; remove it", name));
  }
  take(file.number(), path, shared);
  return file;
}

}  // namespace

OwnDirectory::OwnDirectory(std::string path, const std::string& lock_file, bool shared) : path_(std::move(path)) {
  struct stat own {};
  struct stat named {};
  do {  // another one may have taken its name before it was locked
    directory_ = Descriptor(::open(path_.c_str(), kAsFolder));
    if (directory_.number() < 0 || ::fstat(directory_.number(), &own) != 0) {
      refuse_directory(path_, fmt::format(" cannot be opened: {}", std::strerror(errno)));
    }
    take(directory_.number(), path_, shared);
  } while (::stat(path_.c_str(), &named) != 0 || !is_same(own, named));
  if (!lock_file.empty()) {
    lock_file_ = locked_file(directory_.number(), lock_file, path_, shared);
  }
}

OwnDirectory::~OwnDirectory() {
  for (const Descriptor* held : {&lock_file_, &directory_}) {
    if (held->number() >= 0) {
      ::flock(held->number(), LOCK_UN);  // of copies of this process too
    }
  }
}

Descriptor OwnDirectory::folder(const std::string& name) const {
  return Descriptor(::openat(directory_.number(), name.empty() ? "." : name.c_str(), kAsFolder | O_NOFOLLOW));
}

void OwnDirectory::remove(const std::string& name) const {
  const std::size_t slash = name.find('/');
  const bool in_folder = slash != std::string::npos;
  const Descriptor within = folder(in_folder ? name.substr(0, slash) : "");
  const std::string file = in_folder ? name.substr(slash + 1) : name;
  struct stat about {};
  if (::fstatat(within.number(), file.c_str(), &about, AT_SYMLINK_NOFOLLOW) != 0 || S_ISDIR(about.st_mode)) {
    return;
  }
  if (::unlinkat(within.number(), file.c_str(), 0) != 0 && errno != ENOENT) {
    refuse_directory(path_, fmt::format(" cannot be written to: {}: {}", name, std::strerror(errno)));
  }
}

void OwnDirectory::remove_leftovers(const std::string& folder_name,
                                    const std::function<bool(const std::string&)>& is_own, bool even_living) const {
  touchfield::remove_leftovers(folder(folder_name), is_own, even_living);
}

void OwnDirectory::require_own_folder(const std::string& name) const {
  struct stat about {};
  if (::fstatat(directory_.number(), name.c_str(), &about, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISDIR(about.st_mode)) {
    refuse_directory(path_,
                     S_ISLNK(about.st_mode)
                         ? fmt::format(": its folder {} is a link, which would lead results elsewhere; remove it, or "
                                       "give another directory with -o",
                                       name)
                         : fmt::format(": its {} must be a folder; move it, or give another directory with -o", name));
  }
}

}  // namespace touchfield
