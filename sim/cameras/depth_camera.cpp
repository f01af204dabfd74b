#include "sim/cameras/depth_camera.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <spng.h>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/png_file.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr int kRounds = 50;
constexpr double kUndone = 1e-9;
constexpr double kSameRay = 1e-6;

bool is_straight(const DepthCamera& camera) { return camera.distortion == std::array<double, 5>{}; }

/// The ray that the lens puts at `seen`, by fixed-point steps from there; nothing if they do not end.
std::optional<Eigen::Vector2d> undistorted(const DepthCamera& camera, const Eigen::Vector2d& seen) {
  Eigen::Vector2d ray = seen;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector2d off = distorted(camera, ray) - seen;
    ray -= off;
    if (off.norm() <= kUndone) {
      return ray;
    }
  }
  return {};
}

}  // namespace

Eigen::Vector2d distorted(const DepthCamera& camera, const Eigen::Vector2d& x) {
  const std::array<double, 5>& d = camera.distortion;
  const double r2 = x.squaredNorm();
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  const double xy = 2 * x.x() * x.y();
  return radial * x +
         Eigen::Vector2d(d[2] * xy + d[3] * (r2 + 2 * x.x() * x.x()), d[2] * (r2 + 2 * x.y() * x.y()) + d[3] * xy);
}

std::optional<ImagePoint> image_point(const DepthCamera& camera, const Vector3& x) {
  const Camera& view = camera.view;
  const Vector3 local = view.axes.transpose() * (x - view.eye);
  if (!(local.z() > view.near)) {
    return {};
  }
  ImagePoint point{{}, local.head<2>() / local.z(), local.z()};
  const bool straight = is_straight(camera);
  const Eigen::Vector2d seen = straight ? point.ray : distorted(camera, point.ray);
  point.at = seen.cwiseProduct(view.focal) + view.centre;
  if (!(point.at.x() >= 0 && point.at.y() >= 0 && point.at.x() < view.width && point.at.y() < view.height)) {
    return {};
  }
  if (!straight) {
    const auto ray = undistorted(camera, seen);
    if (!ray || (*ray - point.ray).norm() > kSameRay) {
      return {};
    }
  }
  return point;
}

Eigen::Matrix2Xd pixel_rays(const DepthCamera& camera) {
  const Camera& view = camera.view;
  const bool straight = is_straight(camera);
  Eigen::Matrix2Xd rays(2, static_cast<Eigen::Index>(view.width) * view.height);
  Eigen::Index pixel = 0;
  for (int j = 0; j < view.height; ++j) {
    for (int i = 0; i < view.width; ++i) {
      const Eigen::Vector2d seen = (Eigen::Vector2d(i + 0.5, j + 0.5) - view.centre).cwiseQuotient(view.focal);
      const auto ray = straight ? std::optional(seen) : undistorted(camera, seen);
      require(ray, "camera {}: distortion cannot be undone at pixel ({}, {})", camera.name, i, j);
      rays.col(pixel++) = *ray;
    }
  }
  return rays;
}

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
  require(bytes.starts_with(kSignature), "{}: {}", path,
          bytes.empty() ? "empty, must be a PNG file" : "not a PNG file");
  require(bytes.size() >= kHeaderBytes, "{}: cut off", path);
  require(png_number(bytes.substr(8)) == 13 && bytes.substr(12, 4) == "IHDR",
          "{}: not a PNG file: its header is missing", path);
  const auto columns = png_number(bytes.substr(16));
  const auto rows = png_number(bytes.substr(20));
  const int bits = static_cast<unsigned char>(bytes[24]);
  const auto colour = static_cast<std::size_t>(static_cast<unsigned char>(bytes[25]));
  if (colour != SPNG_COLOR_TYPE_GRAYSCALE) {
    const std::string what = colour < kColours.size() ? kColours[colour] : "";
    refuse_png(path,
               fmt::format("{}, must be 16-bit grey", what.empty() ? fmt::format("colour type {}", colour) : what));
  }
  require(bits == 16, "{}: {} bit{} a pixel, must be 16-bit grey", path, bits, bits == 1 ? "" : "s");
  require(bytes[28] == SPNG_INTERLACE_NONE, "{}: interlaced, must not be", path);
  require(columns == static_cast<std::uint32_t>(width) && rows == static_cast<std::uint32_t>(height),
          "{}: {} x {} pixels, must be {} x {} as its camera has", path, columns, rows, width, height);
}

/// What a PNG of this size may have: the image packed by a bad packer, and a mebibyte of other things.
std::size_t most_png_bytes(int width, int height) {
  const std::size_t image = (2 * static_cast<std::size_t>(width) + 1) * static_cast<std::size_t>(height);
  return image + image / 64 + (std::size_t{1} << 20U);
}

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
  require(image.width >= 1 && image.height >= 1 &&
              image.depth.size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
          "{}: {} depths, must be {} x {}", path, image.depth.size(), image.width, image.height);
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
  require(status == 0, "{}: damaged: {}", path, spng_strerror(status));
  DepthImage image{width, height, std::vector<float>(numbers.size())};
  std::ranges::transform(numbers, image.depth.begin(),
                         [unit](std::uint16_t number) { return static_cast<float>(number * unit); });
  return image;
}

void check_depth_png(const std::string& path, int width, int height) {
  std::error_code error;
  require(std::filesystem::exists(path, error), "{}: no such file", path);
  require(std::filesystem::is_regular_file(path, error), "{}: must be a file", path);
  const std::size_t size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  require(!error && file.good(), "{}: cannot be read", path);
  std::array<char, kHeaderBytes> start{};
  file.read(start.data(), start.size());
  check_png_header(path, {start.data(), static_cast<std::size_t>(file.gcount())}, width, height);
  require(size <= most_png_bytes(width, height), "{}: too long, must be at most {} bytes", path,
          most_png_bytes(width, height));
  std::size_t at = kSignature.size();
  // Of a file of many chunks, finding the end of each would take longer than unpacking it.
  const std::size_t most_parts = 100 + most_png_bytes(width, height) / 2048;
  for (std::size_t part = 0; part < most_parts; ++part) {
    std::array<char, 8> head{};
    file.seekg(static_cast<std::streamoff>(at));
    require(file.read(head.data(), head.size()).good(), "{}: cut off", path);
    at += kChunkFrame + png_number({head.data(), head.size()});
    require(at <= size, "{}: cut off", path);
    if (std::string_view(head.data() + 4, 4) == "IEND") {
      return;
    }
  }
  refuse_png(path, fmt::format("more than {} chunks, must be an ordinary PNG image", most_parts));
}

namespace {

constexpr double kLeastApart = 1e-3;    // of two cameras [m]: none is so small
constexpr double kAtOrigin = 3e-3;      // of all of them [m]
constexpr double kLeastPeriod = 1e-3;   // [s]: depth cameras take up to 300 images per second
constexpr double kMostPeriod = 0.5;     // [s]
constexpr double kOffMiddle = 0.25;     // of the image's size
constexpr double kMostOblong = 1.25;    // of a pixel, the longer side by the shorter one
constexpr double kMiddleOfPixel = 0.5;  // of the upper left one, where the file's columns and rows are 0

void warn_of_places(const std::vector<DepthCamera>& cameras, std::vector<std::string>& warnings) {
  double farthest = 0;
  for (const DepthCamera& camera : cameras) {
    farthest = std::max(farthest, camera.view.eye.norm());
  }
  if (farthest > 0 && farthest < kAtOrigin) {
    warnings.push_back(fmt::format(
        "cameras: {} within {:.2g} mm of the world's origin; if translation_mm holds metres, write millimetres",
        cameras.size() == 1 ? "the camera stands" : "all stand", std::ceil(10 * farthest / kMillimetre) / 10));
    return;
  }
  for (std::size_t c = 1; c < cameras.size(); ++c) {
    for (std::size_t d = 0; d < c; ++d) {
      const double apart = (cameras[c].view.eye - cameras[d].view.eye).norm();
      if (apart < kLeastApart) {
        warnings.push_back(fmt::format(
            "cameras: {} and {} stand {:.2g} mm apart, both at {}; their translation_mm must say where each one is",
            cameras[d].name, cameras[c].name, apart / kMillimetre, place_text(cameras[c].view.eye, 1)));
        return;
      }
    }
  }
}

void warn_of_view(const DepthCamera& camera, std::vector<std::string>& warnings) {
  const Camera& view = camera.view;
  const Eigen::Vector2d size(view.width, view.height);
  const Eigen::Vector2d off = (view.centre.cwiseQuotient(size).array() - 0.5).cwiseAbs();
  if (off.maxCoeff() > kOffMiddle) {
    warnings.push_back(fmt::format(
        "cameras: the axis of {} is at ({:g}, {:g}) in an image of {} x {}, far from its middle; are cx and "
        "cy those of this resolution?",
        camera.name, view.centre.x() - kMiddleOfPixel, view.centre.y() - kMiddleOfPixel, view.width, view.height));
  }
  const double oblong = view.focal.maxCoeff() / view.focal.minCoeff();
  if (oblong > kMostOblong) {
    warnings.push_back(
        fmt::format("cameras: fx = {:g} and fy = {:g} of {} differ by a factor of {:.2g}, and pixels are mostly "
                    "square; are both of "
                    "this resolution?",
                    view.focal.x(), view.focal.y(), camera.name, oblong));
  }
}

void warn_of_times(const std::vector<double>& seconds, std::vector<std::string>& warnings) {
  std::vector<double> periods;
  for (std::size_t k = 1; k < seconds.size(); ++k) {
    periods.push_back(seconds[k] - seconds[k - 1]);
  }
  if (periods.empty()) {
    return;
  }
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  if (*middle > kMostPeriod) {
    warnings.push_back(fmt::format(
        "times: the images are {:.3g} s apart (median), too far to follow a hand; if time_s holds ms, us or numbers of "
        "frames, write seconds",
        *middle));
  } else if (*middle < kLeastPeriod) {
    warnings.push_back(fmt::format(
        "times: the images are {:.3g} s apart (median), which no depth camera is; time_s must be seconds", *middle));
  }
}

}  // namespace

std::vector<std::string> recording_warnings(const std::vector<DepthCamera>& cameras,
                                            const std::vector<double>& seconds) {
  std::vector<std::string> warnings;
  warn_of_places(cameras, warnings);
  for (const DepthCamera& camera : cameras) {
    warn_of_view(camera, warnings);
  }
  warn_of_times(seconds, warnings);
  return warnings;
}

}  // namespace touchfield
