#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/pictures/figures.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/plots.h"
#include "sim/pictures/skin_picture.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

/// What a panel shows.
struct Quantity {
  const char* label;
  double (*of)(const MotionScore&);
};

constexpr std::array<Quantity, 3> kQuantities = {
    {{"relative error [%]", [](const MotionScore& score) { return 100.0 * score.metrics.relative_error; }},
     {"displacement [mm]", [](const MotionScore& score) { return 1e3 * shown_displacement(score); }},
     {"mean |p| inside [Pa]", [](const MotionScore& score) { return score.metrics.mean_inside_pa; }}}};

PlotLine line_of(const MotionMethod& method, const Quantity& quantity) {
  const Statistics error = statistics_of(summary(method), &Metrics::relative_error);
  PlotLine line{.label = method.name,
                .points = {},
                .note = fmt::format("error {} %, p95 {} %", table_number(100.0 * error.median, "{:.1f}"),
                                    table_number(100.0 * error.p95, "{:.1f}"))};
  for (const MotionScore& score : method.scores) {
    const double value = quantity.of(score);
    line.points.push_back({score.time, value, value, value});
  }
  return line;
}

}  // namespace

bool draw_motion(const std::string& path, const Motion& motion) {
  check_motion(motion);
  Plot plot{
      .texts = {.title = picture_title(motion.name, motion.notes),
                .subtitle = motion.complete ? "sensation over time" : "sensation over time, not complete",
                .foot = "Error: median, and 95th percentile (p95). Displacement: movement of the target's patch since "
                        "the sample of the phases."},
      .x = "time [s]",
      .provenance = motion.provenance};
  bool any = false;
  for (const Quantity& quantity : kQuantities) {
    PlotPanel& panel = plot.panels.emplace_back(PlotPanel{quantity.label, {}});
    for (const MotionMethod& method : motion.methods) {
      const PlotLine& line = panel.lines.emplace_back(line_of(method, quantity));
      any = any || std::ranges::any_of(line.points, [](const PlotPoint& point) { return std::isfinite(point.y); });
    }
  }
  if (any) {
    draw_plot(path, plot);
  }
  return any;
}

namespace {

constexpr PixelBox kStrip = {64, 84, 996, 700};  // of the panels and the text above each
constexpr int kError = 26;                       // room of this text

bool has_target(const MotionInstant& instant) { return instant.target && instant.target->size() > 0; }

/// Holds the targets of all instants, or all of the skin.
SkinView view_of(const Motion& motion, const std::vector<MotionInstant>& instants, const PixelBox& panel) {
  constexpr double kTargetShare = 0.55;
  constexpr double kBodyShare = 0.94;
  const bool targets = std::ranges::any_of(instants, has_target);
  Points all(3, 0);
  for (const MotionInstant& instant : instants) {
    const Points own = !targets              ? instant.mesh.vertices()
                       : has_target(instant) ? target_corners(instant.mesh, *instant.target)
                                             : Points(3, 0);
    all.conservativeResize(3, all.cols() + own.cols());
    all.rightCols(own.cols()) = own;
  }
  return fitted_view(panel, facing(motion.array, instants.front().mesh.centroids().rowwise().mean()), all,
                     targets ? kTargetShare : kBodyShare);
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

}  // namespace

std::string motion_strip(const Motion& motion) {
  constexpr int kMost = 6;
  const std::vector<MotionInstant> instants = some_instants(motion, kMost);
  if (instants.empty() || instants.front().pressure.empty()) {
    return "";
  }
  for (const MotionInstant& instant : instants) {
    check_instant(instant);
    const auto same_name = [](const auto& a, const auto& b) { return a.first == b.first; };
    require(std::ranges::equal(instant.pressure, instants.front().pressure, same_name),
            "strip: the instant {} s must have the methods of the first", instant.time);
  }
  const auto& methods = instants.front().pressure;
  const auto columns = static_cast<int>(instants.size());
  const PanelGrid grid = filled_grid(kStrip, columns * static_cast<int>(methods.size()), columns, kError);
  double most_wanted = 0.0;
  std::vector<Eigen::VectorXd> values;  // of a method after another
  for (std::size_t m = 0; m < methods.size(); ++m) {
    for (const MotionInstant& instant : instants) {
      values.emplace_back(1e-3 * instant.pressure[m].second.cwiseAbs());
      most_wanted = std::max(most_wanted, has_target(instant) ? 1e-3 * instant.target->amplitudes.maxCoeff() : 0.0);
    }
  }
  const ColourBar bar = skin_bar("|p| [kPa]", most_wanted, values);
  const SkinView view = view_of(motion, instants, grid.panel(0));
  Canvas canvas(kPictureWidth, kPictureHeight);
  describe(canvas, motion.provenance);
  for (int i = 0; i < columns; ++i) {
    const MotionInstant& instant = instants[static_cast<std::size_t>(i)];
    const SkinLook look(view, instant.mesh, instant.target);
    for (std::size_t m = 0; m < methods.size(); ++m) {
      const int number = static_cast<int>(m) * columns + i;
      const PixelBox panel = grid.panel(number);
      look.draw(canvas, values[static_cast<std::size_t>(number)], bar.top, panel);
      draw_fitted(canvas, panel.x + 0.5 * panel.width, panel.y + panel.height + 0.5 * kError,
                  error_text(motion, methods[m].first, instant.time), {.size = 15, .align = Align::kCentre},
                  panel.width);
      if (i == 0) {
        draw_fitted(canvas, 40.0, panel.y + 0.5 * panel.height, methods[m].first,
                    {.size = 18, .align = Align::kCentre, .bold = true, .angle = 90.0}, panel.height);
      }
    }
    const PixelBox top = grid.panel(i);
    draw_fitted(canvas, top.x + 0.5 * top.width, kStrip.y + kStrip.height + 10.0, fmt::format("{:.3g} s", instant.time),
                {.size = 17, .align = Align::kCentre, .bold = true}, top.width);
  }
  draw_scale_bar(canvas, view.panel, view.scale);
  draw_colour_bar(canvas, bar);
  draw_texts(canvas, {.title = picture_title(motion.name, motion.notes),
                      .subtitle = "|p| on the skin over time, one row per method",
                      .foot = "Seen from the array's side, from one place. Green: the border of the target. Error of "
                              "|p| over the whole skin."});
  return canvas.file();
}

}  // namespace touchfield
