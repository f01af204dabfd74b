#include "sim/pictures/overview_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"
#include "sim/pictures/skin_sight.h"
#include "sim/run/run_layout.h"

namespace touchfield {

namespace {

constexpr PixelBox kColumnsRoom = {30, 100, 1000, 700};  // of all panels and the lines above each
constexpr int kMostColumns = 6;
constexpr int kColumnsOfMany = 4;
constexpr int kColumnGap = 8;
constexpr int kHeadings = 48;  // room of a panel's two lines

struct Column {
  std::string name;
  std::string figures;
  Eigen::VectorXd values;
};

std::vector<Column> columns_of(const Run& run) {
  std::vector<Column> columns;
  if (run.target) {
    columns.push_back({"wanted", fmt::format("{:.3g} kPa", 1e-3 * run.target->amplitudes.maxCoeff()),
                       wanted_pressure(*run.target, run.mesh.face_count())});
  }
  for (const MethodResult& result : run.methods) {
    if (result.pressure.size() != 0) {
      const double error = result.metrics.relative_error;
      columns.push_back({result.name, std::isnan(error) ? "" : fmt::format("error {:.1f} %", 100.0 * error),
                         result.pressure.cwiseAbs()});
    }
  }
  return columns;
}

/// One look at the skin, drawn in panels of one size.
class Look {
 public:
  Look(const Run& run, const SkinView& view) : sight_(view, run.mesh) {
    if (run.target) {
      const Lines lines = target_outline(run.mesh, *run.target);
      outline_ = sight_.visible(lines.points, lines.ends);
    }
  }

  const SkinView& view() const { return sight_.view(); }

  void draw(Canvas& canvas, const std::vector<Colour>& colours, const PixelBox& box) const {
    const PixelBox& own = sight_.view().panel;
    draw_sight(canvas, sight_, colours, box);
    draw_outline(canvas, outline_, Eigen::Vector2d(box.x - own.x, box.y - own.y));
    canvas.frame(box, {170, 170, 170}, 1.0);
  }

 private:
  SkinSight sight_;
  std::vector<Eigen::Vector2d> outline_;
};

}  // namespace

std::string overview_picture(const Run& run, double top, PictureFormat format) {
  const std::vector<Column> columns = columns_of(run);
  const auto count = static_cast<int>(columns.size());
  const bool many = count > kMostColumns;
  const SkinPanels panels = skin_panels(run);
  const bool close = panels.target.has_value();
  const bool whole = !many || !close;
  const int across = many ? kColumnsOfMany : std::max(count, 1);
  const int looks = (whole ? 1 : 0) + (close ? 1 : 0);
  const int rows = (count + across - 1) / across;
  const int width = (kColumnsRoom.width - (across - 1) * kColumnGap) / across;
  const int pitch = kColumnsRoom.height / std::max(rows, 1);  // of a row of columns
  const int height = (pitch - kHeadings - (looks - 1) * kColumnGap) / looks;
  const auto panel = [&](int column, int look) {
    return PixelBox{kColumnsRoom.x + column % across * (width + kColumnGap),
                    kColumnsRoom.y + kColumnsRoom.height - column / across * pitch - kHeadings - (look + 1) * height -
                        look * kColumnGap,
                    width, height};
  };

  Canvas canvas(kPictureWidth, kPictureHeight, format);
  describe(canvas, run.provenance);
  double most = 0.0;
  for (int look = 0; look < looks; ++look) {
    const bool all = whole && look == 0;
    const Look seen(
        run, all ? fitted_view(panel(0, look), panels.body.direction, run.mesh.vertices(), 0.94)
                 : fitted_view(panel(0, look), panels.body.direction, target_corners(run.mesh, *run.target), 0.6));
    for (int column = 0; column < count; ++column) {
      seen.draw(canvas, skin_colours(columns[static_cast<std::size_t>(column)].values, top), panel(column, look));
    }
    PixelBox last = panel(0, look);
    last.y += 26;  // within the panel
    last.x += 8;
    draw_scale_bar(canvas, last, seen.view().scale);
  }
  for (int column = 0; column < count; ++column) {
    const Column& shown = columns[static_cast<std::size_t>(column)];
    const PixelBox box = panel(column, 0);
    const double middle = box.x + 0.5 * width;
    draw_fitted(canvas, middle, box.y + height + 32, shown.name, {.size = 19, .align = Align::kCentre, .bold = true},
                width);
    draw_fitted(canvas, middle, box.y + height + 12, shown.figures, {.size = 16, .align = Align::kCentre}, width);
    most = std::max(most, quantile({shown.values.begin(), shown.values.end()}, 1.0));
  }
  draw_colour_bar(canvas, skin_bar(top, most));
  draw_title(canvas, run.name, "pressure on the skin");
  draw_caption(
      canvas, "",
      fmt::format("Seen from the array's side.{}",
                  run.target ? " Green: the border of the target on the skin. Error: over the whole skin." : ""));
  return canvas.file();
}

}  // namespace touchfield
