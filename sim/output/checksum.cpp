#include "sim/output/checksum.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>
#include <zlib.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr std::string_view kMark = "touchfield-crc32 ";

std::string line_of(uLong crc) { return fmt::format("{}{:08x}\n", kMark, crc); }

}  // namespace

std::string checksum_line(std::string_view bytes) {
  return line_of(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

Checksum check_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = file ? static_cast<std::streamoff>(file.tellg()) : std::streamoff{-1};
  if (size < 0) {
    throw IoError(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
  }
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
  file.seekg(0);
  std::vector<char> block(std::size_t{1} << 20);
  uLong crc = 0;
  for (std::streamoff left = size - kLength; left > 0 && file;) {
    const auto count = std::min(left, static_cast<std::streamoff>(block.size()));
    file.read(block.data(), count);
    crc = crc32_z(crc, reinterpret_cast<const Bytef*>(block.data()), static_cast<std::size_t>(count));
    left -= count;
  }
  if (!file) {
    throw IoError(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
  }
  return last == line_of(crc) ? Checksum::kCorrect : Checksum::kWrong;
}

}  // namespace touchfield
