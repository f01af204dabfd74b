#include "sim/pictures/scan_picture.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/core/files.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kScan = {280, 160, 640, 640};
constexpr Colour kGridLine = {225, 225, 225};
constexpr int kLabelSize = 16;
constexpr int kMostPieces = 6;

}  // namespace

void draw_scan(const std::string& path, const ScanPicture& picture, const Eigen::VectorXd& computed,
               const Eigen::VectorXd& measured, PictureFormat format) {
  const double top = round_above(std::max(computed.maxCoeff(), measured.maxCoeff()));
  const double step = tick_step(top, kMostPieces);
  const auto place = [&](double x, double y) {
    return Eigen::Vector2d(kScan.x + kScan.width * x / top, kScan.y + kScan.height * y / top);
  };
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  for (int i = 0; i * step <= top * (1 + 1e-9); ++i) {
    const double value = i * step;
    canvas.line(place(value, 0), place(value, top), kGridLine, 1.0);
    canvas.line(place(0, value), place(top, value), kGridLine, 1.0);
    canvas.text(place(value, 0).x(), kScan.y - 22.0, fmt::format("{:.6g}", value),
                {.size = kLabelSize, .align = Align::kCentre});
    canvas.text(kScan.x - 14.0, place(0, value).y(), fmt::format("{:.6g}", value),
                {.size = kLabelSize, .align = Align::kRight});
  }
  canvas.frame(kScan, kInk, 1.0);
  canvas.line(place(0, 0), place(top, top), kInk, 1.5);
  for (Eigen::Index j = 0; j < computed.size(); ++j) {
    draw_marker(canvas, 0, place(computed(j), measured(j)), false);
  }
  canvas.text(kScan.x + 0.5 * kScan.width, kScan.y - 52.0, "computed, scaled", {.size = 20, .align = Align::kCentre});
  canvas.text(kScan.x - 110.0, kScan.y + 0.5 * kScan.height, "measured, as in the file",
              {.size = 20, .align = Align::kCentre, .angle = 90.0});
  draw_title(canvas, picture.title, "measured against computed pressure");
  draw_caption(canvas, picture.first, picture.second);
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
