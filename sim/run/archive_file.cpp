#include "sim/run/archive_file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <zlib.h>

#include <Eigen/Core>
#include <fmt/format.h>
#include <hdf5.h>
#include <vtkVersion.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr std::string_view kMark = "touchfield-crc32 ";

std::string digits_of(uLong crc) { return fmt::format("{:08x}", crc); }

std::string line_of(const std::string& digits) { return fmt::format("{}{}\n", kMark, digits); }

[[noreturn]] void fail_to_read(const std::string& path) {
  throw IoError(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
}

/// An open file and how long it is.
std::pair<std::ifstream, std::streamoff> opened(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = file ? static_cast<std::streamoff>(file.tellg()) : std::streamoff{-1};
  if (size < 0) {
    fail_to_read(path);
  }
  return {std::move(file), size};
}

/// CRC-32 of the first `size` bytes.
uLong crc_of(std::ifstream& file, std::streamoff size, const std::string& path) {
  file.seekg(0);
  std::vector<char> block(static_cast<std::size_t>(std::min(size, std::streamoff{1} << 20)));
  uLong crc = 0;
  for (std::streamoff left = size; left > 0 && file;) {
    const auto count = std::min(left, static_cast<std::streamoff>(block.size()));
    file.read(block.data(), count);
    crc = crc32_z(crc, reinterpret_cast<const Bytef*>(block.data()), static_cast<std::size_t>(count));
    left -= count;
  }
  if (!file) {
    fail_to_read(path);
  }
  return crc;
}

/// Compares a file with the line at its end.
/// throws   IoError if it cannot be read
Checksum check_file(const std::string& path) {
  auto [file, size] = opened(path);
  constexpr auto kLength = static_cast<std::streamoff>(kChecksumLength);
  if (size < kLength) {
    return Checksum::kAbsent;
  }
  std::string last(kChecksumLength, '\0');
  file.seekg(size - kLength);
  file.read(last.data(), kLength);
  if (file && !last.starts_with(kMark)) {
    return Checksum::kAbsent;
  }
  return last == line_of(digits_of(crc_of(file, size - kLength, path))) ? Checksum::kCorrect : Checksum::kWrong;
}

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
    require(warn != nullptr, "{}; info, compare and run --from read it nevertheless. Keep notes in a copy", edited);
    warn(edited + "; damage to it may not be noticed");
  }
  return root;
}

std::string format_of(const hdf5::Content& root) {
  return root.has_attribute("format") ? root.text_attribute("format") : "";
}

}  // namespace

std::string checksum(std::string_view bytes) {
  return digits_of(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string checksum_line(std::string_view bytes) { return line_of(checksum(bytes)); }

std::string file_checksum(const std::string& path) {
  auto [file, size] = opened(path);
  return digits_of(crc_of(file, size, path));
}

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

std::vector<std::pair<std::string, std::string>> library_versions() {
  unsigned major = 0;
  unsigned minor = 0;
  unsigned release = 0;
  H5get_libversion(&major, &minor, &release);
  return {{"HDF5", fmt::format("{}.{}.{}", major, minor, release)},
          {"VTK", vtkVersion::GetVTKVersion()},
          {"zlib", zlibVersion()},
          {"Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)}};
}

}  // namespace touchfield
