#include "sim/pictures/sight_picture.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/units.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kSights = {30, 90, 1010, 720};
constexpr int kGap = 10;
constexpr int kLabelHeight = 30;
constexpr std::size_t kOneColumn = 3;  // sights
constexpr Colour kHole = {235, 30, 60};
constexpr Colour kBackground = {240, 240, 240};

/// Columns and rows of an image, from its upper left pixel.
struct ImagePart {
  double left = 0;
  double top = 0;
  double width = 0;
  double height = 0;
};

/// The part with the mesh, as wide for its height as the image; all of it where the mesh is not seen.
ImagePart part_with_mesh(const Raster& exact) {
  constexpr double kMargin = 1.1;
  int left = exact.width;
  int right = -1;
  int top = exact.height;
  int bottom = -1;
  for (int j = 0; j < exact.height; ++j) {
    for (int i = 0; i < exact.width; ++i) {
      if (exact.face[exact.index(i, j)] != Raster::kNothing) {
        left = std::min(left, i);
        right = std::max(right, i);
        top = std::min(top, j);
        bottom = j;
      }
    }
  }
  ImagePart part{0, 0, static_cast<double>(exact.width), static_cast<double>(exact.height)};
  if (right < left) {
    return part;
  }
  const double share =
      std::min(1.0, kMargin * std::max((right - left + 1) / part.width, (bottom - top + 1) / part.height));
  const auto placed = [share](double middle, double size) {
    return std::clamp(middle - 0.5 * share * size, 0.0, size - share * size);
  };
  part.left = placed(0.5 * (left + right + 1), part.width);
  part.top = placed(0.5 * (top + bottom + 1), part.height);
  part.width *= share;
  part.height *= share;
  return part;
}

/// The largest box of an image's shape in a cell, at half its height.
///
/// right   whether it ends at the cell's right side, not begins at its left
PixelBox image_box(const PixelBox& cell, int width, int height, bool right) {
  const double scale = std::min(static_cast<double>(cell.width) / width, static_cast<double>(cell.height) / height);
  const int across = static_cast<int>(scale * width);
  const int down = static_cast<int>(scale * height);
  return {cell.x + (right ? cell.width - across : 0), cell.y + (cell.height - down) / 2, across, down};
}

/// One camera's sight, with what it would be if it were exact.
class SightPanel {
 public:
  SightPanel(const CameraSight& sight, const TriangleMesh& mesh)
      : sight_(sight), mesh_(mesh), exact_(rasterise(sight.camera, mesh.vertices(), mesh.triangles())) {
    if (sight.depth.size() != exact_.depth.size()) {
      throw InputError(
          fmt::format("{}: {} depths, must be {} x {}", sight.label, sight.depth.size(), exact_.width, exact_.height));
    }
  }

  const Raster& exact() const { return exact_; }

  void draw(Canvas& canvas, const PixelBox& cell, double nearest, double farthest) const {
    const int width = (cell.width - kGap) / 2;
    const int height = cell.height - kLabelHeight;
    const PixelBox view = image_box({cell.x, cell.y, width, height}, exact_.width, exact_.height, true);
    const PixelBox close =
        image_box({cell.x + width + kGap, cell.y, width, height}, exact_.width, exact_.height, false);
    const ImagePart whole{0, 0, static_cast<double>(exact_.width), static_cast<double>(exact_.height)};
    const ImagePart part = part_with_mesh(exact_);
    draw_part(canvas, view, whole, [&](std::size_t pixel) { return shaded(pixel); });
    draw_part(canvas, close, part, [&](std::size_t pixel) { return said(pixel, nearest, farthest); });
    const double scale = view.width / whole.width;
    const auto pixels = [](double length) { return static_cast<int>(std::lround(length)); };
    canvas.frame({view.x + pixels(scale * part.left), view.y + view.height - pixels(scale * (part.top + part.height)),
                  pixels(scale * part.width), pixels(scale * part.height)},
                 kInk, 1.5);
    draw_fitted(canvas, view.x, view.y + view.height + 0.5 * kLabelHeight, sight_.label, {.size = 16}, cell.width);
  }

 private:
  template <typename ColourOf>
  void draw_part(Canvas& canvas, const PixelBox& box, const ImagePart& part, const ColourOf& colour) const {
    canvas.image(box, [&](int i, int j) {
      const int column = static_cast<int>(part.left + part.width * (i + 0.5) / box.width);
      const int row = static_cast<int>(part.top + part.height * (1 - (j + 0.5) / box.height));
      return colour(exact_.index(std::min(column, exact_.width - 1), std::min(row, exact_.height - 1)));
    });
    canvas.frame(box, kInk, 1.0);
  }

  /// Lit from the camera.
  Colour shaded(std::size_t pixel) const {
    constexpr double kDark = 60;
    constexpr double kBright = 235;
    if (exact_.face[pixel] == Raster::kNothing) {
      return kBackground;
    }
    const double facing = std::abs(mesh_.normals().col(exact_.face[pixel]).dot(sight_.camera.axes.col(2)));
    Colour grey;
    grey.fill(static_cast<std::uint8_t>(std::lround(kDark + (kBright - kDark) * facing)));
    return grey;
  }

  Colour said(std::size_t pixel, double nearest, double farthest) const {
    const auto depth = static_cast<double>(sight_.depth[pixel]);
    if (depth > 0) {
      return viridis((depth - nearest) / (farthest - nearest));
    }
    return exact_.face[pixel] == Raster::kNothing ? kBackground : kHole;
  }

  const CameraSight& sight_;
  const TriangleMesh& mesh_;
  Raster exact_;
};

}  // namespace

void draw_sights(const std::string& path, const std::string& title, const std::string& subtitle,
                 const TriangleMesh& mesh, const std::vector<CameraSight>& sights, PictureFormat format) {
  std::vector<SightPanel> panels;
  panels.reserve(sights.size());
  double nearest = HUGE_VAL;
  double farthest = 0;
  for (const CameraSight& sight : sights) {
    for (const double depth : panels.emplace_back(sight, mesh).exact().depth) {
      nearest = std::min(nearest, depth);
      farthest = std::isfinite(depth) ? std::max(farthest, depth) : farthest;
    }
  }
  constexpr double kStep = 10 * kMillimetre;
  nearest = farthest > 0 ? kStep * std::floor(nearest / kStep) : 0.0;
  farthest = std::max(kStep * std::ceil(farthest / kStep), nearest + kStep);

  Canvas canvas(kPictureWidth, kPictureHeight, format);
  const int columns = sights.size() > kOneColumn ? 2 : 1;
  const int rows = (static_cast<int>(sights.size()) + columns - 1) / columns;
  for (int s = 0; s < static_cast<int>(sights.size()); ++s) {
    const int width = (kSights.width - (columns - 1) * 2 * kGap) / columns;
    const int height = kSights.height / rows;
    panels[static_cast<std::size_t>(s)].draw(canvas,
                                             {kSights.x + (s % columns) * (width + 2 * kGap),
                                              kSights.y + (rows - 1 - s / columns) * height, width, height - kGap},
                                             nearest, farthest);
  }
  draw_colour_bar(canvas, {.label = "depth [mm]", .bottom = nearest / kMillimetre, .top = farthest / kMillimetre});
  draw_title(canvas, title, subtitle);
  draw_caption(canvas, "left: the view of the camera; right: the measured depths of the framed part",
               "red: skin in view without a measured depth");
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
