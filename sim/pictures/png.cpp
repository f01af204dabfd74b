#include "sim/pictures/png.h"

#include <array>
#include <cstdint>
#include <new>
#include <string_view>
#include <zlib.h>

namespace touchfield {

namespace {

// Faces and paper are of one colour each: more effort of zlib gains little, and the fastest level costs a third more.
constexpr int kEffort = 3;

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) {
    bytes += static_cast<char>(value >> shift & 0xFFU);
  }
  return bytes;
}

void add_chunk(std::string& file, std::string_view type, std::string_view data) {
  const std::string body = std::string(type) + std::string(data);
  const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size());
  file += big_endian(static_cast<std::uint32_t>(data.size())) + body + big_endian(static_cast<std::uint32_t>(crc));
}

/// Each row as its difference to the one above (filter 2), which flat areas and shades make small.
std::string filtered(const ColourImage& image) {
  std::string rows;
  rows.reserve(static_cast<std::size_t>(image.height) * (3U * static_cast<std::size_t>(image.width) + 1U));
  for (int row = 0; row < image.height; ++row) {
    rows += '\2';
    for (int column = 0; column < image.width; ++column) {
      const Colour& here = image.at(column, row);
      const Colour above = row == 0 ? Colour{} : image.at(column, row - 1);
      for (std::size_t c = 0; c < here.size(); ++c) {
        rows += static_cast<char>(here[c] - above[c]);
      }
    }
  }
  return rows;
}

std::string packed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                bytes.size(), kEffort) != Z_OK) {
    throw std::bad_alloc();  // the one error that is left
  }
  result.resize(size);
  return result;
}

}  // namespace

std::string png_file(const ColourImage& image, const std::map<std::string, std::string>& texts) {
  constexpr std::string_view kColours("\x08\x02\x00\x00\x00", 5);  // 8 bits, red green blue, not interlaced
  std::string file = "\x89PNG\r\n\x1a\n";
  add_chunk(file, "IHDR",
            big_endian(static_cast<std::uint32_t>(image.width)) + big_endian(static_cast<std::uint32_t>(image.height)) +
                std::string(kColours));
  for (const auto& [keyword, text] : texts) {
    add_chunk(file, "tEXt", keyword + '\0' + text);
  }
  add_chunk(file, "IDAT", packed(filtered(image)));
  add_chunk(file, "IEND", "");
  return file;
}

}  // namespace touchfield
