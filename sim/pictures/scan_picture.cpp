#include "sim/pictures/scan_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/core/atomic_file.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kScan = {280, 160, 640, 640};
constexpr Colour kGridLine = {225, 225, 225};
constexpr int kLabelSize = 16;
constexpr int kMostPieces = 6;

constexpr int kMapLeft = 60;
constexpr int kMapBottom = 300;
constexpr int kMapSide = 345;  // of a map [pixels]
constexpr int kMapGap = 22;

/// Where points are in a square map.
class MapPlace {
 public:
  explicit MapPlace(const Points& at) {
    const Vector3 low = at.rowwise().minCoeff();
    const Vector3 extent = at.rowwise().maxCoeff() - low;
    Eigen::Index thin = 0;
    extent.minCoeff(&thin);
    across_ = thin == 0 ? 1 : 0;
    up_ = thin == 2 ? 1 : 2;
    middle_ = low + 0.5 * extent;
    const double longest = std::max(extent(across_), extent(up_));
    const double area = std::max(extent(across_) * extent(up_), 1e-3 * longest * longest);
    half_ = longest > 0 ? 0.5 * std::sqrt(area / static_cast<double>(at.cols())) : 0.5e-3;
    side_ = longest + 2 * half_;
  }

  double side() const { return side_; }  // of the map [m]

  /// A little larger than its share, so that no seams show.
  std::vector<Eigen::Vector2d> square(const PixelBox& box, const Vector3& point) const {
    const double scale = box.width / side_;
    const Eigen::Vector2d centre = {box.x + 0.5 * box.width + scale * (point(across_) - middle_(across_)),
                                    box.y + 0.5 * box.height + scale * (point(up_) - middle_(up_))};
    std::vector<Eigen::Vector2d> corners;
    for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
      corners.emplace_back(centre + 1.08 * half_ * scale * Eigen::Vector2d(x, y));
    }
    return corners;
  }

 private:
  Eigen::Index across_;
  Eigen::Index up_;
  Vector3 middle_;
  double half_;  // of a point's square [m]
  double side_;
};

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

void draw_scan_map(const std::string& path, const ScanPicture& picture, const Points& at,
                   const Eigen::VectorXcd& computed, const Eigen::VectorXcd& measured, PictureFormat format) {
  const MapPlace place(at);
  const double top = round_above(std::max(computed.cwiseAbs().maxCoeff(), measured.cwiseAbs().maxCoeff()));
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  const std::array<std::pair<const char*, Eigen::VectorXd>, 3> maps = {
      {{"measured", measured.cwiseAbs()},
       {"computed, scaled", computed.cwiseAbs()},
       {"difference", (computed - measured).cwiseAbs()}}};
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const PixelBox box = {kMapLeft + static_cast<int>(m) * (kMapSide + kMapGap), kMapBottom, kMapSide, kMapSide};
    const auto& [name, value] = maps[m];
    for (Eigen::Index j = 0; j < value.size(); ++j) {
      canvas.polygon(place.square(box, at.col(j)), viridis(value(j) / top));
    }
    canvas.frame(box, kInk, 1.0);
    canvas.text(box.x + 0.5 * box.width, box.y + box.height + 20.0, name, {.size = 20, .align = Align::kCentre});
    draw_scale_bar(canvas, box, place.side() / kMapSide);
  }
  draw_title(canvas, picture.title, fmt::format("colours from 0 to {:.6g}, as in the file of the points", top));
  draw_caption(canvas, picture.first, picture.second);
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
