#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace touchfield {

/// The line that ends a run file: "touchfield-crc32 ", eight hexadecimal digits and a newline. The digits are the
/// CRC-32 (of zlib and PNG) of every byte before the line. HDF5 readers do not look behind a file's own end.
std::string checksum_line(std::string_view bytes);

enum class Checksum {
  kAbsent,  // the file does not end with such a line: cut off, or rewritten by another program
  kCorrect,
  kWrong,
};

/// Hears of a file without its line, which another program has changed.
using Warn = std::function<void(const std::string&)>;

/// Eight hexadecimal digits: the CRC-32 of every byte.
std::string checksum(std::string_view bytes);
/// The same of a file.
/// throws   IoError if it cannot be read
std::string file_checksum(const std::string& path);

/// Compares a file with the line at its end.
/// throws   IoError if it cannot be read
Checksum check_file(const std::string& path);

/// Length of the line in bytes.
inline constexpr std::size_t kChecksumLength = 26;

}  // namespace touchfield
