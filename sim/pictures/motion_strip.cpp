#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/pictures/motion_picture.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"
#include "sim/pictures/skin_sight.h"
#include "sim/run/motion_file.h"

namespace touchfield {

namespace {

constexpr PixelBox kStrip = {64, 122, 996, 662};  // of the panels and the lines below each row
constexpr int kBetween = 6;
constexpr int kBelow = 28;  // room of the error's line

/// Where the panels are; row 0 is the uppermost.
struct Layout {
  int columns;
  int rows;

  int width() const { return (kStrip.width - (columns - 1) * kBetween) / columns; }
  int pitch() const { return kStrip.height / rows; }
  PixelBox panel(int row, int column) const {
    return {kStrip.x + column * (width() + kBetween), kStrip.y + (rows - 1 - row) * pitch() + kBelow, width(),
            pitch() - kBelow};
  }
};

void check_instants(const std::vector<MotionInstant>& instants) {
  if (instants.empty() || instants.front().pressure.empty()) {
    throw InputError("strip: there must be an instant with a method");
  }
  for (const MotionInstant& instant : instants) {
    check_instant(instant);
    if (!std::ranges::equal(
            instant.pressure, instants.front().pressure, {}, [](const auto& p) { return p.first; },
            [](const auto& p) { return p.first; })) {
      throw InputError(fmt::format("strip: the instant {} s must have the methods of the first", instant.time));
    }
  }
}

/// What the view holds: the targets of all instants, or all of the skin.
Points points_of_interest(const std::vector<MotionInstant>& instants, bool targets) {
  std::vector<Points> parts;
  Eigen::Index count = 0;
  for (const MotionInstant& instant : instants) {
    parts.push_back(!targets         ? instant.mesh.vertices()
                    : instant.target ? target_corners(instant.mesh, *instant.target)
                                     : Points(3, 0));
    count += parts.back().cols();
  }
  Points all(3, count);
  Eigen::Index at = 0;
  for (const Points& part : parts) {
    all.middleCols(at, part.cols()) = part;
    at += part.cols();
  }
  return all;
}

SkinView view_of(const Motion& motion, const std::vector<MotionInstant>& instants, const PixelBox& panel) {
  constexpr double kTargetShare = 0.55;
  constexpr double kBodyShare = 0.94;
  const Vector3 direction = facing(motion.array, instants.front().mesh.centroids().rowwise().mean());
  const Points targets = points_of_interest(instants, true);
  return targets.cols() > 0 ? fitted_view(panel, direction, targets, kTargetShare)
                            : fitted_view(panel, direction, points_of_interest(instants, false), kBodyShare);
}

double strip_top(const std::vector<MotionInstant>& instants) {
  double most_wanted = 0.0;
  std::vector<const Eigen::VectorXcd*> pressures;
  for (const MotionInstant& instant : instants) {
    if (instant.target && instant.target->size() > 0) {
      most_wanted = std::max(most_wanted, instant.target->amplitudes.maxCoeff());
    }
    for (const auto& [method, pressure] : instant.pressure) {
      pressures.push_back(&pressure);
    }
  }
  return skin_top(most_wanted, pressures);
}

double most_pressure(const std::vector<MotionInstant>& instants) {
  double most = 0.0;
  for (const MotionInstant& instant : instants) {
    for (const auto& [method, pressure] : instant.pressure) {
      most = std::max(most, quantile(magnitudes(pressure), 1.0));
    }
  }
  return most;
}

/// The error of a method's score at a time, in words; empty if there is none.
std::string error_text(const Motion& motion, const std::string& name, double time) {
  constexpr double kSameTime = 1e-9;  // [s]
  for (const MotionMethod& method : motion.methods) {
    for (const MotionScore& score : method.scores) {
      if (method.name == name && std::abs(score.time - time) < kSameTime &&
          std::isfinite(score.metrics.relative_error)) {
        return fmt::format("error {:.1f} %", 100.0 * score.metrics.relative_error);
      }
    }
  }
  return "";
}

/// The panels of an instant, whose rows share one look at the skin.
void draw_column(Canvas& canvas, const Motion& motion, const MotionInstant& instant, const Layout& layout, int column,
                 const SkinView& view, double top) {
  SkinView own = view;
  own.panel = layout.panel(0, column);
  const SkinSight sight(own, instant.mesh);
  std::vector<Eigen::Vector2d> outline;
  if (instant.target) {
    const Lines lines = target_outline(instant.mesh, *instant.target);
    outline = sight.visible(lines.points, lines.ends);
  }
  for (int row = 0; row < layout.rows; ++row) {
    const auto& [method, pressure] = instant.pressure[static_cast<std::size_t>(row)];
    const PixelBox box = layout.panel(row, column);
    draw_sight(canvas, sight, skin_colours(pressure.cwiseAbs(), top), box);
    draw_outline(canvas, outline, {0.0, box.y - own.panel.y});
    canvas.frame(box, {110, 110, 110}, 1.0);
    draw_fitted(canvas, box.x + 0.5 * box.width, box.y - 0.5 * kBelow, error_text(motion, method, instant.time),
                {.size = 15, .align = Align::kCentre}, box.width);
  }
  const PixelBox above = layout.panel(0, column);
  draw_fitted(canvas, above.x + 0.5 * above.width, above.y + above.height + 14.0, fmt::format("{:.3g} s", instant.time),
              {.size = 17, .align = Align::kCentre}, above.width);
}

}  // namespace

void draw_motion_strip(const std::string& path, const Motion& motion, const std::vector<MotionInstant>& instants,
                       PictureFormat format) {
  check_instants(instants);
  const Layout layout = {static_cast<int>(instants.size()), static_cast<int>(instants.front().pressure.size())};
  const SkinView view = view_of(motion, instants, layout.panel(0, 0));
  const double top = strip_top(instants);
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  describe(canvas, motion.provenance);
  for (int column = 0; column < layout.columns; ++column) {
    draw_column(canvas, motion, instants[static_cast<std::size_t>(column)], layout, column, view, top);
  }
  for (int row = 0; row < layout.rows; ++row) {
    const PixelBox box = layout.panel(row, 0);
    draw_fitted(canvas, 40.0, box.y + 0.5 * box.height, instants.front().pressure[static_cast<std::size_t>(row)].first,
                {.size = 18, .align = Align::kCentre, .bold = true, .angle = 90.0}, box.height);
  }
  PixelBox lowest = layout.panel(layout.rows - 1, 0);
  lowest.y -= kBelow;
  draw_scale_bar(canvas, lowest, view.scale);
  draw_colour_bar(canvas, skin_bar(top, most_pressure(instants)));
  draw_title(canvas, motion.name, "the skin over time, one row per method");
  draw_caption(canvas, "", "Seen from the array's side, from one place. Green: the border of the target on the skin.");
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
