#include "sim/run/archive_file.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

/// throws   InputError if there is no such file or it does not begin as every HDF5 file does
void require_hdf5(const std::string& path) {
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  std::error_code error;
  const bool is_file = std::filesystem::is_regular_file(path, error);
  require(is_file, "{}: {}", path, error ? error.message() : "is not a file");
  std::ifstream file(path, std::ios::binary);
  require(file, "{}: cannot read: {}", path, std::strerror(errno));
  std::array<char, 64> start{};
  file.read(start.data(), start.size());
  const std::string_view begin(start.data(), static_cast<std::size_t>(file.gcount()));
  require(begin.starts_with(kSignature), "{}: is not an HDF5 file", path);
}

/// Damage is met here, before HDF5 is asked to make sense of it. A file that is cut has no checksum, and HDF5 refuses
/// it by its size.
hdf5::Content opened(const std::string& path, const Warn& warn) {
  require_hdf5(path);
  const Checksum checksum = check_file(path);
  require(checksum != Checksum::kWrong, "{}: is damaged: its checksum is wrong", path);
  hdf5::Content root = hdf5::read_content(path);
  if (checksum == Checksum::kAbsent) {
    const std::string edited =
        fmt::format("{}: the checksum line at its end is missing, so another program has changed the file", path);
    require(warn != nullptr, "{}; info, compare and run --from read it nevertheless", edited);
    warn(edited + "; damage to it would not be noticed");
  }
  return root;
}

std::string format_of(const hdf5::Content& root) {
  return root.has_attribute("format") ? root.text_attribute("format") : "";
}

}  // namespace

void write_archive(const std::string& path, const hdf5::MemoryFile& file) {
  const std::string bytes = file.bytes();
  write_atomically(path, {bytes, checksum_line(bytes)});
}

hdf5::Content read_archive(const std::string& path, const ArchiveFormat& format, const Warn& warn) {
  hdf5::Content root = opened(path, warn);
  require(format_of(root) == format.name(),
          "{}: is an HDF5 file but not a touchfield {} (its attribute format must be {})", path, format.noun,
          format.name());
  require_format(path, root.integer_attribute("format_version"), format.version);
  return root;
}

std::string archive_format(const std::string& path) {
  return format_of(opened(path, [](const std::string&) {}));
}

void require_undamaged(const std::string& path, const std::function<void()>& check) {
  try {
    check();
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: is damaged: {}", path, error.what()));
  }
}

}  // namespace touchfield
