#include "sim/pictures/skin_picture.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kWhole = {30, 100, 1010, 700};
constexpr PixelBox kLeftPanel = {30, 100, 420, 700};
constexpr PixelBox kRightPanel = {470, 100, 570, 700};
constexpr Colour kOutline = {235, 30, 60};
constexpr Colour kFrame = {110, 110, 110};

Points target_corners(const TriangleMesh& mesh, const Target& target) {
  Points corners(3, 3 * target.size());
  for (Eigen::Index k = 0; k < target.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      corners.col(3 * k + c) = mesh.corner(target.faces[static_cast<std::size_t>(k)], c);
    }
  }
  return corners;
}

/// Where the close view lies in the view of the whole body.
PixelBox footprint(const SkinView& close, const SkinView& whole) {
  const Eigen::Vector2d centre = whole.pixel(close.centre);
  const double shrink = close.scale / whole.scale;
  const auto pixels = [](double length) { return static_cast<int>(std::lround(length)); };
  return {pixels(centre.x() - 0.5 * shrink * close.panel.width), pixels(centre.y() - 0.5 * shrink * close.panel.height),
          pixels(shrink * close.panel.width), pixels(shrink * close.panel.height)};
}

/// Moves a close view so that its footprint stays in the panel of the whole body.
SkinView inside(SkinView close, const SkinView& whole) {
  const PixelBox box = footprint(close, whole);
  const auto shift = [](int low, int size, int panel_low, int panel_size) {
    return std::max(panel_low - low, 0) + std::min(panel_low + panel_size - (low + size), 0);
  };
  const PixelBox& panel = whole.panel;
  close.centre += whole.scale * (shift(box.x, box.width, panel.x, panel.width) * close.right() +
                                 shift(box.y, box.height, panel.y, panel.height) * close.up);
  return close;
}

}  // namespace

SkinPanels skin_panels(const Run& run) {
  constexpr double kBodyShare = 0.94;
  constexpr double kTargetShare = 0.6;
  constexpr double kWorthACloseView = 0.6;  // of the body's scale
  const Points& vertices = run.mesh.vertices();
  const Vector3 direction = facing(run.array, run.mesh.centroids().rowwise().mean());
  if (run.target) {
    const SkinView whole = fitted_view(kLeftPanel, direction, vertices, kBodyShare);
    const SkinView close = fitted_view(kRightPanel, direction, target_corners(run.mesh, *run.target), kTargetShare);
    if (close.scale < kWorthACloseView * whole.scale) {
      return {whole, inside(close, whole)};
    }
  }
  return {fitted_view(kWhole, direction, vertices, kBodyShare), std::nullopt};
}

Eigen::Matrix2Xi target_outline(const TriangleMesh& mesh, const Target& target) {
  std::map<std::pair<int, int>, int> uses;
  for (const Eigen::Index face : target.faces) {
    for (int c = 0; c < 3; ++c) {
      ++uses[std::minmax({mesh.triangles()(c, face), mesh.triangles()((c + 1) % 3, face)})];
    }
  }
  std::erase_if(uses, [](const auto& use) { return use.second != 1; });
  Eigen::Matrix2Xi edges(2, static_cast<Eigen::Index>(uses.size()));
  Eigen::Index e = 0;
  for (const auto& [edge, count] : uses) {
    edges.col(e++) << edge.first, edge.second;
  }
  return edges;
}

std::string skin_picture(const Run& run, const Eigen::VectorXd& values, double top, const SkinText& text) {
  std::vector<Colour> colours;
  colours.reserve(static_cast<std::size_t>(values.size()));
  std::ranges::transform(values, std::back_inserter(colours), [&](double value) { return viridis(value / top); });
  const Eigen::Matrix2Xi outline = run.target ? target_outline(run.mesh, *run.target) : Eigen::Matrix2Xi(2, 0);
  const SkinPanels panels = skin_panels(run);

  Canvas canvas(kPictureWidth, kPictureHeight);
  describe(canvas, run);
  canvas.surface(panels.body, run.mesh, colours, outline, kOutline);
  draw_scale_bar(canvas, panels.body.panel, panels.body.scale);
  if (panels.target) {
    canvas.surface(*panels.target, run.mesh, colours, outline, kOutline);
    draw_scale_bar(canvas, panels.target->panel, panels.target->scale);
    canvas.frame(panels.target->panel, kFrame, 1.5);
    canvas.frame(footprint(*panels.target, panels.body), kFrame, 1.5);
  }
  draw_colour_bar(canvas, top);
  draw_title(canvas, text.title, text.subtitle);
  const std::string legend = run.target ? " Red: the target's outline." : "";
  draw_caption(canvas, text.caption,
               fmt::format("Seen from the array's side. Colours from 0 to {:.6g} Pa in every picture of this run's "
                           "skin; what lies above has the last colour.{}",
                           top, legend));
  return canvas.png();
}

}  // namespace touchfield
