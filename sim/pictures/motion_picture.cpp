#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/pictures/figures.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"
#include "sim/pictures/skin_sight.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

constexpr int kPanelCount = 3;
constexpr int kPanelLeft = 120;
constexpr int kPanelWidth = 760;
constexpr int kPanelsBottom = 170;
constexpr int kPanelHeight = 190;
constexpr int kPanelGap = 24;
constexpr double kNames = kPanelLeft + kPanelWidth + 44.0;  // left side of the legend

/// What a panel shows.
struct Quantity {
  const char* label;
  double (*of)(const MotionScore&);
};

constexpr std::array<Quantity, kPanelCount> kQuantities = {
    {{"relative error [%]", [](const MotionScore& score) { return 100.0 * score.metrics.relative_error; }},
     {"displacement [mm]", [](const MotionScore& score) { return 1e3 * shown_displacement(score); }},
     {"mean |p| inside [Pa]", [](const MotionScore& score) { return score.metrics.mean_inside_pa; }}}};

PixelBox panel_box(int number) {
  return {kPanelLeft, kPanelsBottom + (kPanelCount - 1 - number) * (kPanelHeight + kPanelGap), kPanelWidth,
          kPanelHeight};
}

/// Of all methods, those that are numbers.
std::vector<double> values_of(const Motion& motion, const Quantity& quantity) {
  std::vector<double> values;
  for (const MotionMethod& method : motion.methods) {
    for (const MotionScore& score : method.scores) {
      if (const double value = quantity.of(score); std::isfinite(value)) {
        values.push_back(value);
      }
    }
  }
  return values;
}

/// The line of a method, whose markers, about ten, stand between those of the others.
void draw_method(Canvas& canvas, const MotionMethod& method, std::size_t number, std::size_t methods,
                 const Quantity& quantity, const LinearAxis& x, const LinearAxis& y) {
  constexpr std::size_t kMarkers = 10;
  std::vector<Eigen::Vector2d> piece;
  std::vector<Eigen::Vector2d> marked;
  const std::size_t stride = std::max<std::size_t>(1, method.scores.size() / kMarkers);
  for (std::size_t i = 0; i < method.scores.size(); ++i) {
    const double value = quantity.of(method.scores[i]);
    if (!std::isfinite(value)) {
      canvas.path(piece, marker_colour(number), 2.0);
      piece.clear();
      continue;
    }
    piece.emplace_back(x.pixel(method.scores[i].time), y.pixel(value));
    if (i % stride == number * stride / methods) {
      marked.push_back(piece.back());
    }
  }
  canvas.path(piece, marker_colour(number), 2.0);
  for (const Eigen::Vector2d& place : marked) {
    draw_marker(canvas, number, place, false);
  }
}

void draw_names(Canvas& canvas, const Motion& motion) {
  constexpr double kRoom = kPictureWidth - kNames - 26.0 - 24.0;
  double y = kPanelsBottom + kPanelCount * kPanelHeight + (kPanelCount - 1) * kPanelGap - 16.0;
  for (std::size_t m = 0; m < motion.methods.size(); ++m) {
    const Statistics error = statistics_of(summary(motion.methods[m]), &Metrics::relative_error);
    canvas.line({kNames - 20.0, y}, {kNames + 20.0, y}, marker_colour(m), 2.0);
    draw_marker(canvas, m, {kNames, y}, false);
    draw_fitted(canvas, kNames + 30.0, y, motion.methods[m].name, {.size = 18}, kRoom);
    draw_fitted(canvas, kNames + 30.0, y - 22.0,
                fmt::format("error: median {} %, 95 % of", table_number(100.0 * error.median, "{:.1f}")), {.size = 13},
                kRoom);
    draw_fitted(canvas, kNames + 30.0, y - 38.0,
                fmt::format("scores below {} %", table_number(100.0 * error.p95, "{:.1f}")), {.size = 13}, kRoom);
    y -= 68.0;
  }
}

}  // namespace

bool draw_motion(const std::string& path, const Motion& motion, PictureFormat format) {
  check_motion(motion);
  if (std::ranges::all_of(kQuantities, [&](const Quantity& quantity) { return values_of(motion, quantity).empty(); })) {
    return false;
  }
  double last = motion.seconds;
  std::size_t scores = 0;
  for (const MotionMethod& method : motion.methods) {
    scores = std::max(scores, method.scores.size());
    for (const MotionScore& score : method.scores) {
      last = std::max(last, score.time);
    }
  }
  Canvas canvas(kPictureWidth, kPictureHeight, format);
  describe(canvas, motion.provenance);
  for (int p = 0; p < kPanelCount; ++p) {
    const Quantity& quantity = kQuantities.at(static_cast<std::size_t>(p));
    const std::vector<double> values = values_of(motion, quantity);
    const auto [least, most] =
        values.empty() ? std::ranges::minmax_result<double>{0.0, 1.0} : std::ranges::minmax(values);
    const PixelBox box = panel_box(p);
    const LinearAxis x(0.0, last, box.x, box.width, 10);
    const LinearAxis y(axis_begin(least, most), most, box.y, box.height, 6);
    draw_plot(canvas, box, x, y, p == kPanelCount - 1);
    draw_fitted(canvas, 36.0, box.y + 0.5 * box.height, quantity.label,
                {.size = 18, .align = Align::kCentre, .angle = 90.0}, box.height + kPanelGap);
    for (std::size_t m = 0; m < motion.methods.size(); ++m) {
      draw_method(canvas, motion.methods[m], m, motion.methods.size(), quantity, x, y);
    }
  }
  canvas.text(kPanelLeft + 0.5 * kPanelWidth, kPanelsBottom - 52.0, "time [s]", {.size = 20, .align = Align::kCentre});
  draw_names(canvas, motion);
  draw_title(canvas, picture_title(motion.name, motion.notes), "sensation over time");
  draw_caption(canvas,
               fmt::format("{} scores per method{}", scores, motion.complete ? "" : "; the motion is not complete"),
               "Displacement: movement of the target's patch since the sample of the phases.");
  write_atomically(path, {canvas.file()});
  return true;
}

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
  require(!instants.empty() && !instants.front().pressure.empty(), "strip: there must be an instant with a method");
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
  const SkinLook look(own, instant.mesh, instant.target);
  for (int row = 0; row < layout.rows; ++row) {
    const auto& [method, pressure] = instant.pressure[static_cast<std::size_t>(row)];
    const PixelBox box = layout.panel(row, column);
    look.draw(canvas, skin_colours(pressure.cwiseAbs(), top), box);
    canvas.frame(box, {110, 110, 110}, 1.0);
    draw_fitted(canvas, box.x + 0.5 * box.width, box.y - 0.5 * kBelow, error_text(motion, method, instant.time),
                {.size = 15, .align = Align::kCentre}, box.width);
  }
  const PixelBox& above = own.panel;
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
  draw_colour_bar(canvas, skin_bar({.top = top}, most_pressure(instants)));
  draw_title(canvas, picture_title(motion.name, motion.notes), "the skin over time, one row per method");
  draw_caption(canvas, "", "Seen from the array's side, from one place. Green: the border of the target on the skin.");
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
