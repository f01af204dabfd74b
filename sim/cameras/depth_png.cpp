#include "sim/cameras/depth_png.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <spng.h>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/png_file.h"

namespace touchfield {

namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::size_t kChunkFrame = 12;                                     // length, type and CRC of a chunk
constexpr std::size_t kHeaderBytes = kSignature.size() + kChunkFrame + 13;  // until the image's format has been said
constexpr std::size_t kMostUnpacked = std::size_t{64} << 20U;  // [bytes] of texts and profiles, which are not kept

[[noreturn]] void refuse_png(const std::string& path, const std::string& what) { throw InputError(path + ": " + what); }

std::uint32_t png_number(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(0, 4)) {
    value = value << 8U | static_cast<unsigned char>(byte);
  }
  return value;
}

/// Refuses a file by its first kHeaderBytes, fewer if it has no more.
void check_png_header(const std::string& path, std::string_view bytes, int width, int height) {
  constexpr std::array<const char*, 7> kColours{
      "", "", "colour", "a palette", "grey with alpha", "", "colour with alpha"};
  if (!bytes.starts_with(kSignature)) {
    refuse_png(path, bytes.empty() ? "empty, must be a PNG file" : "not a PNG file");
  }
  if (bytes.size() < kHeaderBytes) {
    refuse_png(path, "cut off");
  }
  if (png_number(bytes.substr(8)) != 13 || bytes.substr(12, 4) != "IHDR") {
    refuse_png(path, "not a PNG file: its header is missing");
  }
  const auto columns = png_number(bytes.substr(16));
  const auto rows = png_number(bytes.substr(20));
  const int bits = static_cast<unsigned char>(bytes[24]);
  const auto colour = static_cast<std::size_t>(static_cast<unsigned char>(bytes[25]));
  if (colour != SPNG_COLOR_TYPE_GRAYSCALE) {
    const std::string what = colour < kColours.size() ? kColours[colour] : "";
    refuse_png(path,
               fmt::format("{}, must be 16-bit grey", what.empty() ? fmt::format("colour type {}", colour) : what));
  }
  if (bits != 16) {
    refuse_png(path, fmt::format("{} bit{} a pixel, must be 16-bit grey", bits, bits == 1 ? "" : "s"));
  }
  if (bytes[28] != SPNG_INTERLACE_NONE) {
    refuse_png(path, "interlaced, must not be");
  }
  if (columns != static_cast<std::uint32_t>(width) || rows != static_cast<std::uint32_t>(height)) {
    refuse_png(path, fmt::format("{} x {} pixels, must be {} x {} as its camera has", columns, rows, width, height));
  }
}

/// What a PNG of this size may have: the image packed by a bad packer, and a mebibyte of other things.
std::size_t most_png_bytes(int width, int height) {
  const std::size_t image = (2 * static_cast<std::size_t>(width) + 1) * static_cast<std::size_t>(height);
  return image + image / 64 + (std::size_t{1} << 20U);
}

/// And into how many parts that may be cut: of a file of many, finding the end of each would take longer than unpacking
/// it.
std::size_t most_png_parts(int width, int height) { return 100 + most_png_bytes(width, height) / 2048; }

std::vector<std::uint16_t> depth_numbers(const std::string& path, const DepthImage& image, double unit) {
  std::vector<std::uint16_t> numbers;
  numbers.reserve(image.depth.size());
  for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel) {
    const auto depth = static_cast<double>(image.depth[pixel]);
    if (!(depth >= 0 && std::isfinite(depth))) {
      const auto width = static_cast<std::size_t>(image.width);
      refuse_png(path, fmt::format("depth {} m at pixel ({}, {}), must be finite and >= 0", depth, pixel % width,
                                   pixel / width));
    }
    const double units = std::round(depth / unit);
    numbers.push_back(static_cast<std::uint16_t>(units > kMostUnits ? 0 : units));
  }
  return numbers;
}

}  // namespace

void write_depth_png(const std::string& path, const DepthImage& image, double unit) {
  if (image.width < 1 || image.height < 1 ||
      image.depth.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    refuse_png(path, fmt::format("{} depths, must be {} x {}", image.depth.size(), image.width, image.height));
  }
  const std::vector<std::uint16_t> numbers = depth_numbers(path, image, unit);
  write_atomically(path, {png_file(image.width, image.height, PngPixels::kGrey16, std::as_bytes(std::span(numbers)))});
}

DepthImage read_depth_png(const std::string& path, double unit, int width, int height) {
  const std::string bytes = read_whole_file(path, most_png_bytes(width, height));
  check_depth_png(path, width, height);
  std::vector<std::uint16_t> numbers(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> png(spng_ctx_new(0), spng_ctx_free);
  int status = spng_set_chunk_limits(png.get(), kMostUnpacked, kMostUnpacked);
  status = status != 0 ? status : spng_set_crc_action(png.get(), SPNG_CRC_ERROR, SPNG_CRC_ERROR);
  status = status != 0 ? status : spng_set_png_buffer(png.get(), bytes.data(), bytes.size());
  status = status != 0 ? status : spng_decode_image(png.get(), numbers.data(), 2 * numbers.size(), SPNG_FMT_PNG, 0);
  status = status != 0 ? status : spng_decode_chunks(png.get());
  if (status != 0) {
    refuse_png(path, fmt::format("damaged: {}", spng_strerror(status)));
  }
  DepthImage image{width, height, std::vector<float>(numbers.size())};
  std::ranges::transform(numbers, image.depth.begin(),
                         [unit](std::uint16_t number) { return static_cast<float>(number * unit); });
  return image;
}

void check_depth_png(const std::string& path, int width, int height) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    refuse_png(path, "no such file");
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    refuse_png(path, "must be a file");
  }
  const std::size_t size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) {
    refuse_png(path, "cannot be read");
  }
  std::array<char, kHeaderBytes> start{};
  file.read(start.data(), start.size());
  check_png_header(path, {start.data(), static_cast<std::size_t>(file.gcount())}, width, height);
  if (size > most_png_bytes(width, height)) {
    refuse_png(path, fmt::format("too long, must be at most {} bytes", most_png_bytes(width, height)));
  }
  std::size_t at = kSignature.size();
  const std::size_t most_parts = most_png_parts(width, height);
  for (std::size_t part = 0; part < most_parts; ++part) {
    std::array<char, 8> head{};
    file.seekg(static_cast<std::streamoff>(at));
    if (!file.read(head.data(), head.size())) {
      refuse_png(path, "cut off");
    }
    at += kChunkFrame + png_number({head.data(), head.size()});
    if (at > size) {
      refuse_png(path, "cut off");
    }
    if (std::string_view(head.data() + 4, 4) == "IEND") {
      return;
    }
  }
  refuse_png(path, fmt::format("more than {} chunks, must be an ordinary PNG image", most_parts));
}

}  // namespace touchfield
