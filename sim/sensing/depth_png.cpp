#include "sim/sensing/depth_png.h"

#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <png.h>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "sim/core/atomic_file.h"
#include "sim/core/errors.h"
#include "sim/core/file_kind.h"
#include "sim/core/whole_file.h"

namespace touchfield {

namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::size_t kChunkFrame = 12;                                     // length, type and CRC of a chunk
constexpr std::size_t kHeaderBytes = kSignature.size() + kChunkFrame + 13;  // until the image's format has been said
constexpr int kPngEffort = 3;                                               // of zlib: noise gains little from more
constexpr std::size_t kMostAtLast = std::size_t{256} << 10U;  // [bytes] of the file from an image's last row on

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
    refuse_png(path, bytes.empty() ? "empty, must be a PNG file" : "not a PNG file" + and_what_it_is(bytes));
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
  if (colour != PNG_COLOR_TYPE_GRAY) {
    const std::string what = colour < kColours.size() ? kColours[colour] : "";
    refuse_png(path,
               fmt::format("{}, must be 16-bit grey", what.empty() ? fmt::format("colour type {}", colour) : what));
  }
  if (bits != 16) {
    refuse_png(path, fmt::format("{} bit{} a pixel, must be 16-bit grey", bits, bits == 1 ? "" : "s"));
  }
  if (bytes[28] != PNG_INTERLACE_NONE) {
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

/// And into how many parts that may be cut: of a file of many, finding the end of each would take longer than unpacking it.
std::size_t most_png_parts(int width, int height) { return 100 + most_png_bytes(width, height) / 2048; }

// libpng leaves by longjmp where it fails. So what it calls keeps no object with a destructor, and neither does the
// function that it returns to.
struct PngMessages {
  std::array<char, 128> error{};
};

[[noreturn]] void keep_png_error(png_structp png, png_const_charp text) {
  auto& error = static_cast<PngMessages*>(png_get_error_ptr(png))->error;
  std::snprintf(error.data(), error.size(), "%s", text);
  png_longjmp(png, 1);
}

void ignore_png_warning(png_structp /*png*/, png_const_charp /*text*/) {}

struct PngSource {
  const char* bytes;
  std::size_t left;
  const char* at_end = "cut off";
};

void take_bytes(png_structp png, png_bytep out, std::size_t count) {
  auto* source = static_cast<PngSource*>(png_get_io_ptr(png));
  if (count > source->left) {
    png_error(png, source->at_end);
  }
  std::memcpy(out, source->bytes, count);
  source->bytes += count;
  source->left -= count;
}

/// Fills in the rows, big-endian; false after an error, which is in the messages.
bool unpack_png(png_structp png, png_infop info, PngSource* source, png_bytep rows, std::size_t row_bytes, int height) {
  if (setjmp(png_jmpbuf(png)) != 0) {
    return false;
  }
  png_set_read_fn(png, source, &take_bytes);
  png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);  // texts and profiles are not unpacked
  png_read_info(png, info);
  if (png_get_rowbytes(png, info) != row_bytes) {
    png_error(png, "two headers");
  }
  for (int row = 0; row < height; ++row) {
    // With its last row libpng unpacks whatever comes after it, up to a thousand bytes a byte.
    if (row == height - 1 && source->left > kMostAtLast) {
      source->left = kMostAtLast;
      source->at_end = "too much follows its last row";
    }
    png_read_row(png, rows + static_cast<std::size_t>(row) * row_bytes, nullptr);
  }
  png_read_end(png, nullptr);
  return true;
}

struct PngSink {
  std::string* bytes;
};

void put_bytes(png_structp png, png_bytep data, std::size_t count) {
  bool full = false;
  try {
    static_cast<PngSink*>(png_get_io_ptr(png))->bytes->append(reinterpret_cast<const char*>(data), count);
  } catch (const std::bad_alloc&) {
    full = true;
  }
  if (full) {
    png_error(png, "out of memory");
  }
}

bool pack_png(png_structp png, png_infop info, PngSink* sink, png_const_bytep rows, int width, int height) {
  if (setjmp(png_jmpbuf(png)) != 0) {
    return false;
  }
  png_set_write_fn(png, sink, &put_bytes, nullptr);
  png_set_compression_level(png, kPngEffort);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 16, PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  for (int row = 0; row < height; ++row) {
    png_write_row(png, rows + 2 * static_cast<std::size_t>(row) * static_cast<std::size_t>(width));
  }
  png_write_end(png, nullptr);
  return true;
}

/// libpng's two structs, of a reader or a writer.
class Png {
 public:
  explicit Png(bool reads)
      : reads_(reads),
        png_(reads ? png_create_read_struct(PNG_LIBPNG_VER_STRING, &messages_, &keep_png_error, &ignore_png_warning)
                   : png_create_write_struct(PNG_LIBPNG_VER_STRING, &messages_, &keep_png_error, &ignore_png_warning)),
        info_(png_ == nullptr ? nullptr : png_create_info_struct(png_)) {
    if (info_ == nullptr) {
      destroy();
      throw std::bad_alloc();
    }
  }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;
  ~Png() { destroy(); }

  png_structp png() const { return png_; }
  png_infop info() const { return info_; }
  const char* error() const { return messages_.error.data(); }

 private:
  void destroy() {
    if (reads_) {
      png_destroy_read_struct(&png_, &info_, nullptr);
    } else {
      png_destroy_write_struct(&png_, &info_);
    }
  }

  bool reads_;
  PngMessages messages_;
  png_structp png_;
  png_infop info_;
};

/// The numbers of the file, big-endian as it has them.
std::vector<png_byte> depth_numbers(const std::string& path, const DepthImage& image, double unit) {
  std::vector<png_byte> bytes;
  bytes.reserve(2 * image.depth.size());
  for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel) {
    const auto depth = static_cast<double>(image.depth[pixel]);
    if (!(depth >= 0 && std::isfinite(depth))) {
      const auto width = static_cast<std::size_t>(image.width);
      refuse_png(path, fmt::format("depth {} m at pixel ({}, {}), must be finite and >= 0", depth, pixel % width,
                                   pixel / width));
    }
    const double units = std::round(depth / unit);
    const auto number = static_cast<unsigned>(units > kMostUnits ? 0 : units);
    bytes.push_back(static_cast<png_byte>(number >> 8U));
    bytes.push_back(static_cast<png_byte>(number & 0xFFU));
  }
  return bytes;
}

}  // namespace

void write_depth_png(const std::string& path, const DepthImage& image, double unit) {
  if (image.width < 1 || image.height < 1 ||
      image.depth.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    refuse_png(path, fmt::format("{} depths, must be {} x {}", image.depth.size(), image.width, image.height));
  }
  const std::vector<png_byte> rows = depth_numbers(path, image, unit);
  std::string bytes;
  PngSink sink{&bytes};
  const Png writer(false);
  if (!pack_png(writer.png(), writer.info(), &sink, rows.data(), image.width, image.height)) {
    throw IoError(fmt::format("{}: cannot be packed: {}", path, writer.error()));
  }
  write_atomically(path, {bytes});
}

DepthImage read_depth_png(const std::string& path, double unit, int width, int height) {
  const std::string bytes = read_whole_file(path, most_png_bytes(width, height));
  check_png_header(path, bytes, width, height);
  const std::size_t row_bytes = 2 * static_cast<std::size_t>(width);
  std::vector<png_byte> rows(row_bytes * static_cast<std::size_t>(height));
  PngSource source{.bytes = bytes.data(), .left = bytes.size()};
  const Png reader(true);
  if (!unpack_png(reader.png(), reader.info(), &source, rows.data(), row_bytes, height)) {
    refuse_png(path, fmt::format("damaged: {}", reader.error()));
  }
  DepthImage image{width, height, std::vector<float>(rows.size() / 2)};
  for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel) {
    const unsigned number = static_cast<unsigned>(rows[2 * pixel]) << 8U | rows[2 * pixel + 1];
    image.depth[pixel] = static_cast<float>(number * unit);
  }
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
  refuse_png(path, fmt::format("more than {} parts, must be a PNG image as programs write it", most_parts));
}

}  // namespace touchfield
