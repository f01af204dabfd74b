#include "sim/pictures/motion_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/files.h"
#include "sim/pictures/linear_axis.h"
#include "sim/pictures/picture_parts.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_stages.h"
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
  draw_title(canvas, motion.name, "sensation over time");
  draw_caption(canvas,
               fmt::format("{} scores per method{}", scores, motion.complete ? "" : "; the motion is not complete"),
               "Displacement: movement of the target's patch since the sample of the phases.");
  write_atomically(path, {canvas.file()});
  return true;
}

}  // namespace touchfield
