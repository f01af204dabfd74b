#include "sim/pictures/skin_picture.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kWhole = {30, 100, 1010, 700};
constexpr PixelBox kLeftPanel = {30, 100, 420, 700};
constexpr PixelBox kRightPanel = {470, 100, 570, 700};
constexpr Colour kFrame = {110, 110, 110};

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

Points target_corners(const TriangleMesh& mesh, const Target& target) {
  Points corners(3, 3 * target.size());
  for (Eigen::Index k = 0; k < target.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      corners.col(3 * k + c) = mesh.corner(target.faces[static_cast<std::size_t>(k)], c);
    }
  }
  return corners;
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

void draw_outline(Canvas& canvas, const std::vector<Eigen::Vector2d>& ends, const Eigen::Vector2d& shift) {
  constexpr Colour kOutline = {235, 30, 60};
  constexpr double kOutlineWidth = 2.0;  // [pixels]
  for (std::size_t i = 0; i < ends.size(); i += 2) {
    canvas.path({ends[i] + shift, ends[i + 1] + shift}, kOutline, kOutlineWidth);
  }
}

SkinPictures::SkinPictures(const Run& run, PictureFormat format)
    : run_(run),
      format_(format),
      outline_(run.target ? target_outline(run.mesh, *run.target) : Eigen::Matrix2Xi(2, 0)),
      body_(skin_panels(run).body, run.mesh) {
  if (const auto close = skin_panels(run).target) {
    target_.emplace(*close, run.mesh);
  }
}

void SkinPictures::draw_panel(Canvas& canvas, const SkinSight& sight, const std::vector<Colour>& colours) const {
  draw_sight(canvas, sight, colours);
  draw_outline(canvas, sight.visible(run_.mesh.vertices(), outline_));
}

std::string SkinPictures::picture(const Eigen::VectorXd& values, double top, const SkinText& text) const {
  std::vector<Colour> colours;
  colours.reserve(static_cast<std::size_t>(values.size()));
  std::ranges::transform(values, std::back_inserter(colours), [&](double value) { return viridis(value / top); });

  Canvas canvas(kPictureWidth, kPictureHeight, format_);
  describe(canvas, run_.provenance);
  draw_panel(canvas, body_, colours);
  draw_scale_bar(canvas, body_.view().panel, body_.view().scale);
  if (target_) {
    draw_panel(canvas, *target_, colours);
    draw_scale_bar(canvas, target_->view().panel, target_->view().scale);
    canvas.frame(target_->view().panel, kFrame, 1.0);
    canvas.frame(footprint(target_->view(), body_.view()), kFrame, 1.0);
  }
  draw_colour_bar(canvas, top);
  draw_title(canvas, text.title, text.subtitle);
  const std::string legend = run_.target ? " Red: the target's outline." : "";
  draw_caption(canvas, text.caption,
               fmt::format("Seen from the array's side. Colours from 0 to {:.6g} Pa in every picture of this run's "
                           "skin; values above are clipped.{}",
                           top, legend));
  return canvas.file();
}

}  // namespace touchfield
