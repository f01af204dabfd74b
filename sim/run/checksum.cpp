#include "sim/run/checksum.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>
#include <zlib.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

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

}  // namespace

std::string checksum(std::string_view bytes) {
  return digits_of(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string checksum_line(std::string_view bytes) { return line_of(checksum(bytes)); }

std::string file_checksum(const std::string& path) {
  auto [file, size] = opened(path);
  return digits_of(crc_of(file, size, path));
}

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

}  // namespace touchfield
