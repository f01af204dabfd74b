#include "sim/pictures/study_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "sim/bem/scheme.h"
#include "sim/core/atomic_file.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

constexpr PixelBox kPlot = {110, 160, 760, 620};
constexpr double kLegend = kPlot.x + kPlot.width + 40.0;        // its left side
constexpr double kLegendRoom = kPictureWidth - kLegend - 36.0;  // of its texts
constexpr double kLegendLine = 34.0;                            // [pixels]
constexpr Colour kDecadeLine = {205, 205, 205};
constexpr Colour kTickLine = {234, 234, 234};
constexpr int kTickSize = 16;        // of the labels at ticks [pixels]
constexpr double kDigitWidth = 9.2;  // of one in such a label, and its share of the space between two [pixels]

struct Axis {
  std::vector<LogTick> ticks;
  double start;   // [pixels]
  double length;  // [pixels]

  Axis(double low, double high, int start_pixel, int pixels)
      : ticks(log_ticks(low, high)), start(start_pixel), length(pixels) {}

  double low() const { return ticks.front().value; }
  double decades() const { return std::log10(ticks.back().value / low()); }
  double pixel(double value) const { return start + length * std::log10(value / low()) / decades(); }
  /// Whether labels this large have room at all ticks; if not, decades alone are labelled.
  bool has_room(double pixels) const { return length / decades() * std::log10(2.0) > pixels; }
};

std::string tick_label(const LogTick& tick) { return fmt::format("{:.6g}", tick.value); }

/// A rung that can be drawn.
struct Dot {
  double seconds;
  double percent;
  std::size_t marker;
  bool pareto;
};

bool can_be_drawn(const StudyRung& rung) {
  return std::isfinite(rung.seconds) && rung.seconds > 0 && std::isfinite(rung.error_reference) &&
         rung.error_reference > 0;
}

void draw_ring(Canvas& canvas, const Eigen::Vector2d& centre) {
  constexpr double kRing = 18.0;
  constexpr int kPieces = 48;
  std::vector<Eigen::Vector2d> ring;
  for (int i = 0; i <= kPieces; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kPieces;
    ring.emplace_back(centre + kRing * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  canvas.path(ring, kInk, 2.5);
}

void draw_axes(Canvas& canvas, const Axis& x, const Axis& y) {
  const double right = kPlot.x + kPlot.width;
  const double top = kPlot.y + kPlot.height;
  for (const bool decades : {false, true}) {  // their lines on top of the others'
    for (const bool upright : {true, false}) {
      for (const LogTick& tick : (upright ? x : y).ticks) {
        const double at = (upright ? x : y).pixel(tick.value);
        if (tick.decade == decades) {
          canvas.line(upright ? Eigen::Vector2d(at, kPlot.y) : Eigen::Vector2d(kPlot.x, at),
                      upright ? Eigen::Vector2d(at, top) : Eigen::Vector2d(right, at),
                      decades ? kDecadeLine : kTickLine, 1.0);
        }
      }
    }
  }
  canvas.frame(kPlot, kInk, 1.0);
  double widest = 0.0;
  for (const LogTick& tick : x.ticks) {
    widest = std::max(widest, kDigitWidth * static_cast<double>(tick_label(tick).size()));
  }
  for (const LogTick& tick : x.ticks) {
    const double at = x.pixel(tick.value);
    canvas.line({at, kPlot.y}, {at, kPlot.y - (tick.decade ? 9.0 : 5.0)}, kInk, 1.0);
    if (tick.decade || x.has_room(widest)) {
      canvas.text(at, kPlot.y - 22.0, tick_label(tick), {.size = kTickSize, .align = Align::kCentre});
    }
  }
  for (const LogTick& tick : y.ticks) {
    const double at = y.pixel(tick.value);
    canvas.line({kPlot.x, at}, {kPlot.x - (tick.decade ? 9.0 : 5.0), at}, kInk, 1.0);
    if (tick.decade || y.has_room(kTickSize)) {
      canvas.text(kPlot.x - 14.0, at, tick_label(tick), {.size = kTickSize, .align = Align::kRight});
    }
  }
  canvas.text(kPlot.x + 0.5 * kPlot.width, kPlot.y - 52.0, "time to solve [s]", {.size = 20, .align = Align::kCentre});
  canvas.text(30.0, kPlot.y + 0.5 * kPlot.height, "error of the pressure [%]",
              {.size = 20, .align = Align::kCentre, .angle = 90.0});
}

void draw_legend(Canvas& canvas, const std::vector<Dot>& dots, bool picked) {
  double y = kPlot.y + kPlot.height - 20.0;
  for (std::size_t i = 0; i < all_schemes().size(); ++i) {
    if (std::ranges::any_of(dots, [&](const Dot& dot) { return dot.marker == i; })) {
      draw_marker(canvas, i, {kLegend, y}, false);
      draw_fitted(canvas, kLegend + 26.0, y, to_string(all_schemes()[i]), {.size = 18}, kLegendRoom);
      y -= kLegendLine;
    }
  }
  if (std::ranges::any_of(dots, &Dot::pareto)) {
    y -= 0.5 * kLegendLine;
    canvas.line({kLegend - 16.0, y}, {kLegend + 16.0, y}, kInk, 1.5);
    canvas.text(kLegend + 26.0, y, "no other is both faster", {.size = 18});
    canvas.text(kLegend + 26.0, y - 22.0, "and more accurate", {.size = 18});
    y -= kLegendLine + 22.0;
  }
  if (picked) {
    draw_ring(canvas, {kLegend, y - 6.0});
    canvas.text(kLegend + 26.0, y - 6.0, "picked", {.size = 18});
  }
}

void draw_dots(Canvas& canvas, const Axis& x, const Axis& y, std::vector<Dot> dots) {
  const auto place = [&](const Dot& dot) { return Eigen::Vector2d(x.pixel(dot.seconds), y.pixel(dot.percent)); };
  std::ranges::stable_sort(dots, {}, &Dot::seconds);
  std::stable_partition(dots.begin(), dots.end(), [](const Dot& dot) { return !dot.pareto; });
  std::vector<Eigen::Vector2d> best;
  for (const Dot& dot : dots) {
    if (dot.pareto) {
      best.push_back(place(dot));
    }
  }
  canvas.path(best, kInk, 1.5);
  for (const Dot& dot : dots) {
    draw_marker(canvas, dot.marker, place(dot), dot.pareto);
  }
}

std::string picked_text(const StudyRung& rung) {
  return fmt::format("Picked: {}, edge {} mm, {} faces: {:.3g} s, error {:.3g} %", rung.scheme,
                     table_number(rung.edge_mm, "{:.3g}"), grouped(rung.faces), rung.seconds,
                     100.0 * rung.error_reference);
}

std::string count_text(std::size_t drawn, std::size_t all) {
  const std::string left_out = drawn == all ? "" : "; those without a time and an error > 0 are left out";
  return fmt::format("{} of {} ways{}.", drawn, all, left_out);
}

/// The ends of the values with some room for the markers.
std::pair<double, double> range_of(const std::vector<Dot>& dots, double Dot::*value) {
  constexpr double kRoom = 1.1;
  if (dots.empty()) {
    return {1.0, 10.0};
  }
  const auto [low, high] = std::ranges::minmax(dots, {}, value);
  return {low.*value / kRoom, high.*value * kRoom};
}

}  // namespace

void draw_study(const std::string& path, const std::string& title, const std::vector<StudyRung>& rungs,
                std::optional<std::size_t> picked, PictureFormat format) {
  std::vector<Dot> dots;
  for (const StudyRung& rung : rungs) {
    if (can_be_drawn(rung)) {
      dots.push_back({rung.seconds, 100.0 * rung.error_reference, scheme_rank(rung.scheme), rung.pareto});
    }
  }
  const auto [fastest, slowest] = range_of(dots, &Dot::seconds);
  const auto [least, most] = range_of(dots, &Dot::percent);
  const Axis x(fastest, slowest, kPlot.x, kPlot.width);
  const Axis y(least, most, kPlot.y, kPlot.height);
  const StudyRung* choice = picked && can_be_drawn(rungs.at(*picked)) ? &rungs[*picked] : nullptr;

  Canvas canvas(kPictureWidth, kPictureHeight, format);
  draw_axes(canvas, x, y);
  draw_dots(canvas, x, y, dots);
  if (choice != nullptr) {
    draw_ring(canvas, {x.pixel(choice->seconds), y.pixel(100.0 * choice->error_reference)});
  }
  draw_legend(canvas, dots, choice != nullptr);
  draw_title(canvas, title, "speed against error");
  const std::string how =
      choice == nullptr ? "" : fmt::format("Solver {}, precision {}. ", choice->solver, choice->precision);
  draw_caption(canvas, choice == nullptr ? "" : picked_text(*choice), how + count_text(dots.size(), rungs.size()));
  write_atomically(path, {canvas.file()});
}

}  // namespace touchfield
