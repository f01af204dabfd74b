#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <iterator>
#include <ranges>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/pictures/figures.h"
#include "sim/pictures/plots.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

constexpr int kMap = 146;      // side of a map [pixels]
constexpr int kHead = 150;     // room above the first row
constexpr int kValues = 26;    // room above each row
constexpr int kBelow = 140;    // room below the maps, of the axis and texts
constexpr int kSpectra = 520;  // room of the spectra
constexpr Colour kHalfLine = {213, 94, 0};

/// What a column shows.
struct FeltColumn {
  const char* heading;
  const char* quantity;
  double factor;      // from SI to the unit
  double most_shown;  // the colours' end over the median of the methods
  std::size_t skin;

  const Eigen::MatrixXd& map(const FeltMethod& method) const {
    return most_shown > 2.0 ? method.skins[skin].energy.back() : method.skins[skin].displacement;
  }
};

constexpr std::array<FeltColumn, 5> kColumns = {{{"no mechanics", "radiation pressure, rms [Pa]", 1.0, 2.0, 3},
                                                 {"soft skin", "displacement, rms [um]", 1e6, 2.0, 0},
                                                 {"middle skin", "displacement, rms [um]", 1e6, 2.0, 1},
                                                 {"stiff skin", "displacement, rms [um]", 1e6, 2.0, 2},
                                                 {"middle skin, 2 mm deep", "strain energy [uJ/m3]", 1e6, 4.0, 1}}};

/// A map with the line of its half, and the places of points.
void draw_map(Canvas& canvas, const PixelBox& box, const Eigen::MatrixXd& map, double top,
              const std::vector<FeltPoint>& points) {
  const double pixel = 2.0 * SkinPatch::kReach / box.width;
  const double half = 0.5 * largest(map);
  canvas.image(box, [&](int i, int j) {
    const auto at = [&](double right, double up) {
      return map_at(map, (Eigen::Array2d(i + right, j + up) * pixel - SkinPatch::kReach).matrix());
    };
    const double value = at(0.5, 0.5);
    const double slope = std::hypot(at(1.5, 0.5) - value, at(0.5, 1.5) - value);              // per pixel
    const double share = std::max(0.0, std::min(2.0 - std::abs(value - half) / slope, 1.0));  // of the line; 0 of NaN
    Colour colour = std::isnan(value) ? kPaper : viridis(value / top);
    for (std::size_t c = 0; c < colour.size(); ++c) {
      colour[c] = static_cast<std::uint8_t>(std::lround((1.0 - share) * colour[c] + share * kHalfLine[c]));
    }
    return colour;
  });
  for (const FeltPoint& point : points) {
    const Eigen::Vector2d at = (point.place.array() + SkinPatch::kReach) / pixel + Eigen::Array2d(box.x, box.y);
    canvas.line(at - Eigen::Vector2d(4.0, 0.0), at + Eigen::Vector2d(4.0, 0.0), kPaper, 1.5);
    canvas.line(at - Eigen::Vector2d(0.0, 4.0), at + Eigen::Vector2d(0.0, 4.0), kPaper, 1.5);
  }
  canvas.frame(box, kInk, 1.0);
}

/// The flat axes of a map [mm]: numbers below the lowest of a column and at the left of the first of a row.
void draw_map_axes(Canvas& canvas, const PixelBox& box, bool first, bool lowest) {
  constexpr double kEnd = 1e3 * SkinPatch::kReach;
  for (const double tick : even_ticks(-kEnd, kEnd, 5)) {
    const double along = (tick + kEnd) / (2.0 * kEnd) * box.width;
    const std::string number = fmt::format("{:g}", tick);
    canvas.line({box.x + along, box.y}, {box.x + along, box.y - 5.0}, kInk, 1.0);
    canvas.line({box.x, box.y + along}, {box.x - 4.0, box.y + along}, kInk, 1.0);
    canvas.text(box.x + along, box.y - 16.0, lowest ? number : "", {.size = 14, .align = Align::kCentre});
    canvas.text(box.x - 9.0, box.y + along, first ? number : "", {.size = 14, .align = Align::kRight});
  }
  const double middle = 0.5 * box.width;
  canvas.text(box.x + middle, box.y - 36.0, lowest ? "x [mm]" : "", {.size = 15, .align = Align::kCentre});
  canvas.text(box.x - 46.0, box.y + middle, first ? "y [mm]" : "",
              {.size = 15, .align = Align::kCentre, .angle = 90.0});
}

/// Sticks at the frequencies of the lines, one colour per point.
Plot spectra_of(const Felt& felt, const FeltMethod& method) {
  Plot plot{.texts = {}, .x = "frequency [Hz]", .legend = "at the points"};
  for (std::size_t s = 0; s < 3; ++s) {
    PlotPanel& panel = plot.panels.emplace_back(PlotPanel{.label = method.skins[s].skin + " [um]", .lines = {}});
    for (std::size_t p = 0; p < felt.points.size(); ++p) {
      PlotLine& line = panel.lines.emplace_back(PlotLine{.label = felt.points[p].name, .points = {}});
      line.is_joined = false;
      for (std::size_t l = 0; l < method.lines.hz.size(); ++l) {
        const double peak =
            1e6 * std::abs(method.skins[s].at_points(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(p)));
        line.points.push_back({method.lines.hz[l], peak, 0.0, peak});
      }
    }
  }
  return plot;
}

}  // namespace

std::string felt_picture(const Felt& felt) {
  const std::span shown(felt.methods.data(), std::min<std::size_t>(felt.methods.size(), 6));
  const auto rows = static_cast<int>(shown.size());
  const auto columns = static_cast<int>(kColumns.size());
  const int spectra = felt.methods.size() == 1 ? kSpectra : 0;
  const int height = kHead + rows * (kValues + kMap + PanelGrid::kGap) + kBelow + spectra;
  const PanelGrid grid = {
      .left = 116, .top = height - kHead, .width = 208, .height = kMap, .columns = columns, .above = kValues};
  Canvas canvas(kPictureWidth, height);
  describe(canvas, felt.provenance);
  for (int i = 0; i < rows * columns; ++i) {
    const FeltColumn& column = kColumns[static_cast<std::size_t>(i % columns)];
    const FeltMethod& method = shown[static_cast<std::size_t>(i / columns)];
    const Eigen::MatrixXd& map = column.map(method);
    std::vector<double> peaks;
    std::ranges::transform(shown, std::back_inserter(peaks),
                           [&](const FeltMethod& own) { return column.factor * largest(column.map(own)); });
    const double most = std::ranges::max(peaks);
    const double top = round_above(std::min(most, column.most_shown * quantile(peaks, 0.5)));
    const PixelBox panel = grid.panel(i);
    const PixelBox box = {panel.x, panel.y, kMap, kMap};
    draw_map(canvas, box, map, top / column.factor, felt.points);
    draw_map_axes(canvas, box, i % columns == 0, i / columns + 1 == rows);
    draw_fitted(canvas, box.x, box.y + kMap + 0.5 * kValues,
                fmt::format("max {:.4g}, {} mm2", peaks[static_cast<std::size_t>(i / columns)],
                            table_number(1e6 * half_area(map), "{:.3g}")),
                {.size = 14}, kMap);
    if (i % columns == 0) {
      draw_fitted(canvas, 30.0, box.y + 0.5 * kMap, method.name,
                  {.size = 18, .align = Align::kCentre, .bold = true, .angle = 90.0}, kMap + kValues);
    }
    if (i < columns) {
      const int lowest = grid.panel((rows - 1) * columns).y;
      const PixelBox bar = {box.x + kMap + 6, lowest, 10, box.y + kMap - lowest};
      draw_colour_bar(canvas, {.box = bar, .label = "", .top = top, .most = most});
      draw_fitted(canvas, box.x, height - 108.0, column.heading, {.size = 17, .bold = true}, panel.width);
      draw_fitted(canvas, box.x, height - 132.0, column.quantity, {.size = 15}, panel.width);
    }
  }
  if (spectra > 0) {
    draw_panels(canvas, spectra_of(felt, shown[0]), {116, kBelow + 10, 800, spectra - 70});
  }
  const auto& hz = shown[0].lines.hz;
  const auto text = [](const Vector3& v) {
    const Eigen::Array3d rounded = (100.0 * v).array().round() / 100.0 + 0.0;
    return fmt::format("({:g}, {:g}, {:g})", rounded(0), rounded(1), rounded(2));
  };
  const auto left_out = std::span(felt.methods).subspan(shown.size()) | std::views::transform(&FeltMethod::name);
  draw_texts(canvas, {.title = felt.name + ", vibration of the skin",
                      .subtitle = fmt::format("Flat skin under the radiation pressure, frequencies up to {:.4g} Hz",
                                              hz.empty() ? 0.0 : hz.back()),
                      .caption = "Flat layers; three skins side by side: they differ more than most methods do. "
                                 "Nothing here says what is felt.",
                      .foot = fmt::format(
                          "Orange: half of the map's largest value, and the area above it. Middle: {} mm, seen "
                          "from outside; x along {}, y along {}.{} {}",
                          text(1e3 * felt.patch.middle), text(felt.patch.axes.col(0)), text(felt.patch.axes.col(1)),
                          left_out.empty() ? "" : " Not shown:", fmt::join(left_out, ", "))});
  return canvas.file();
}

}  // namespace touchfield
