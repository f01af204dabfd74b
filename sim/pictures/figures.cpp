#include "sim/pictures/figures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/pictures/skin_picture.h"

namespace touchfield {

namespace {

constexpr int kAxisLeft = 72;           // room of the axis [pixels]
constexpr int kAxisBelow = 46;          // likewise
constexpr int kBarRight = 100;          // room of the colour bar
constexpr int kMethod = 26;             // room of its name above each panel
constexpr double kLowestLevel = -40.0;  // [dB]
constexpr Colour kBody = {190, 190, 190};
constexpr std::array<char, 3> kAxes = {'x', 'y', 'z'};

std::size_t index(int axis) { return static_cast<std::size_t>(axis); }
/// The extent of the cells around a grid's points along an axis [m].
double extent(const FieldGrid& grid, int axis) { return grid.spacing[axis] * grid.count[index(axis)]; }

/// Where the cells begin along an axis [m].
double low_end(const FieldGrid& grid, int axis) { return grid.origin[axis] - 0.5 * grid.spacing[axis]; }

/// A half's grid, its panels of the plane's shape, in the half's middle.
PanelGrid plane_grid(const PixelBox& half, int count, const Eigen::Vector2d& size) {
  const PixelBox room = {half.x + kAxisLeft, half.y + kAxisBelow, half.width - kAxisLeft - kBarRight,
                         half.height - kAxisBelow};
  PanelGrid grid = fitted_grid(room, count, kMethod, size);
  const Eigen::Vector2i pixels = (shown_scale(grid, size) * size).array().round().cast<int>().max(1);
  const int rows = (count + grid.columns - 1) / grid.columns;
  grid.left += grid.columns * (grid.width - pixels.x()) / 2;
  grid.top -= rows * (grid.height - pixels.y()) / 2;
  grid.width = pixels.x();
  grid.height = pixels.y();
  return grid;
}

/// Draws one plane of a run in its panels, which all are of one size.
class PlanePicture {
 public:
  PlanePicture(Canvas& canvas, const Run& run, const FieldResult& field, const PlaneView& view)
      : canvas_(canvas),
        field_(field),
        view_(view),
        width_(view.grids[0].width),
        height_(view.grids[0].height),
        in_target_(index(width_ * height_), 0) {
    for (int j = 0; run.target && j < height_; ++j) {
      for (int i = 0; i < width_; ++i) {
        in_target_[index(j * width_ + i)] = std::ranges::any_of(run.target->boxes, [&](const TargetBox& box) {
          return box.shape != TargetShape::kMask && holds(box, place(i + 0.5, j + 0.5));
        });
      }
    }
    constexpr double kNear = 5e-3;  // [m] of the plane: half of a pitch of usual arrays
    constexpr double kHalf = 4.0;   // [pixels]
    for (Eigen::Index n = 0; n < run.array.size(); ++n) {
      const Vector3 from =
          (run.array.positions.col(n) - place(0, 0)).cwiseQuotient(place(width_, height_) - place(0, 0));
      const Eigen::Array2d share(from[view.horizontal], from[view.vertical]);
      if (std::abs(run.array.positions(view.normal, n) - field.grid.origin[view.normal]) <= kNear &&
          (share >= 0.0).all() && (share <= 1.0).all()) {
        const Vector3 axis = run.array.axes.col(n);
        const Eigen::Vector2d across =
            kHalf * Eigen::Vector2d(axis[view.horizontal], axis[view.vertical]).unitOrthogonal();
        const Eigen::Vector2d at = share * Eigen::Array2d(width_, height_);
        transducers_.emplace_back(at - across, at + across);
      }
    }
  }

  /// One panel.
  ///
  /// colour   of |p| [Pa]
  template <class ColourOf>
  void draw(const PixelBox& box, const Eigen::VectorXcd& pressure, const ColourOf& colour) const {
    const FieldGrid& grid = field_.grid;
    const std::array<Eigen::Index, 3> stride = {1, grid.count[0],
                                                static_cast<Eigen::Index>(grid.count[0]) * grid.count[1]};
    const auto nearest = [&](int pixel, int pixels, int axis) {
      return static_cast<Eigen::Index>(grid.count[index(axis)]) * (2 * pixel + 1) / (2 * pixels) * stride[index(axis)];
    };
    canvas_.image(box, [&](int i, int j) {
      const Eigen::Index at = nearest(i, width_, view_.horizontal) + nearest(j, height_, view_.vertical);
      return is_border(i, j)                                    ? kPaper
             : field_.inside[static_cast<std::size_t>(at)] != 0 ? kBody
                                                                : colour(std::abs(pressure(at)));
    });
    for (const auto& [from, to] : transducers_) {
      const Eigen::Vector2d corner(box.x, box.y);
      canvas_.line(corner + from, corner + to, kPaper, 3.0);
    }
    canvas_.frame(box, kInk, 1.0);
  }

  /// The ticks below a panel, or at its left.
  void draw_ticks(const PixelBox& box, bool below) const {
    const int axis = below ? view_.horizontal : view_.vertical;
    const int pixels = below ? width_ : height_;
    const double low = low_end(field_.grid, axis);
    const double length = extent(field_.grid, axis);
    for (const double tick : even_ticks(low, low + length, std::clamp(pixels / 40, 2, 10))) {
      const double along = (tick - low) / length * pixels;
      const Eigen::Vector2d at(box.x + (below ? along : 0.0), box.y + (below ? 0.0 : along));
      const Eigen::Vector2d away(below ? 0.0 : -1.0, below ? -1.0 : 0.0);
      canvas_.line(at, at + 5.0 * away, kInk, 1.0);
      const Eigen::Vector2d text = at + (below ? 16.0 : 9.0) * away;
      if (!below || along <= pixels - 12) {  // or the number would reach into the next panel
        canvas_.text(text.x(), text.y(), fmt::format("{:.6g}", std::round(tick * 1e9) / 1e6 + 0.0),
                     {.size = 14, .align = below ? Align::kCentre : Align::kRight});
      }
    }
  }

 private:
  /// A point of the plane by its pixel in a panel.
  Vector3 place(double column, double row) const {
    Vector3 x = field_.grid.origin;
    x[view_.horizontal] =
        low_end(field_.grid, view_.horizontal) + column / width_ * extent(field_.grid, view_.horizontal);
    x[view_.vertical] = low_end(field_.grid, view_.vertical) + row / height_ * extent(field_.grid, view_.vertical);
    return x;
  }

  /// Whether the pixel is the first on another side of the target's border.
  bool is_border(int i, int j) const {
    const auto within = [&](int column, int row) { return in_target_[index(row * width_ + column)]; };
    return (i > 0 && within(i, j) != within(i - 1, j)) || (j > 0 && within(i, j) != within(i, j - 1));
  }

  Canvas& canvas_;
  const FieldResult& field_;
  const PlaneView& view_;
  int width_;
  int height_;
  std::vector<char> in_target_;  // of each pixel of a panel, from the lower left one
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> transducers_{};  // those in the plane [pixels of a panel]
};

/// The end of a method's colours [Pa].
double field_top(const FieldResult& field, const Eigen::VectorXcd& pressure) {
  std::vector<double> outside;
  for (Eigen::Index i = 0; i < pressure.size(); ++i) {
    if (field.inside[static_cast<std::size_t>(i)] == 0) {
      outside.push_back(std::abs(pressure(i)));
    }
  }
  return round_above(quantile(std::move(outside), kTopShare));
}

}  // namespace

bool is_plane(const FieldGrid& grid) { return std::ranges::count(grid.count, 1) == 1; }

PlaneView plane_view(const FieldGrid& grid, int methods) {
  const int normal = static_cast<int>(std::ranges::find(grid.count, 1) - grid.count.begin());
  PlaneView view{normal == 0 ? 1 : 0, normal == 2 ? 1 : 2, normal, {}};
  const PixelBox room = {20, 76, kPictureWidth - 30, picture_height(methods) - 192};
  const Eigen::Vector2d size(extent(grid, view.horizontal), extent(grid, view.vertical));
  for (const int beside : {2, 1}) {
    const PanelGrid halves = filled_grid(room, 2, beside, 0);
    const PanelGrid found = plane_grid(halves.panel(0), methods, size);
    if (beside == 2 || shown_scale(found, size) > shown_scale(view.grids[0], size)) {
      view.grids = {found, plane_grid(halves.panel(1), methods, size)};
    }
  }
  return view;
}

std::string field_picture(const Run& run, const FieldResult& field) {
  const auto count = static_cast<int>(field.pressure.size());
  const PlaneView view = plane_view(field.grid, count);
  std::vector<double> tops;
  for (const auto& [method, pressure] : field.pressure) {
    tops.push_back(field_top(field, pressure));
  }
  const double loudest = std::ranges::max(tops);
  Canvas canvas(kPictureWidth, picture_height(count));
  describe(canvas, run.provenance);
  const PlanePicture plane(canvas, run, field, view);
  for (const bool levels : {false, true}) {
    const PanelGrid& panels = view.grids.at(levels ? 1 : 0);
    for (int m = 0; m < count; ++m) {
      const auto& [method, pressure] = field.pressure[index(m)];
      const PixelBox box = panels.panel(m);
      const double top = tops[index(m)];
      plane.draw(box, pressure, [&](double p) {
        return viridis(levels ? 1.0 - 20.0 * std::log10(std::max(p / loudest, 1e-30)) / kLowestLevel : p / top);
      });
      if (m % panels.columns == 0) {
        plane.draw_ticks(box, false);
      }
      if (m + panels.columns >= count) {
        plane.draw_ticks(box, true);
      }
      draw_fitted(canvas, box.x + 0.5 * box.width, box.y + box.height + 0.5 * kMethod,
                  levels ? method : fmt::format("{}, 1 = {:.4g} kPa", method, 1e-3 * top),
                  {.size = 16, .align = Align::kCentre, .bold = true}, box.width);
    }
    const PixelBox first = panels.panel(0);
    const PixelBox last = panels.panel((count - 1) / panels.columns * panels.columns);
    const PixelBox right = panels.panel(std::min(count, panels.columns) - 1);
    ColourBar bar =
        levels ? ColourBar{.label = "level [dB]", .bottom = kLowestLevel, .top = 0.0} : ColourBar{.label = "|p|"};
    bar.box = {right.x + right.width + 16, last.y, 20, first.y + first.height - last.y};
    draw_colour_bar(canvas, bar);
    canvas.text(0.5 * (first.x + right.x + right.width), last.y - 36,
                fmt::format("{} [mm]", kAxes[index(view.horizontal)]), {.size = 15, .align = Align::kCentre});
    canvas.text(first.x - 56, last.y + 0.5 * bar.box.height, fmt::format("{} [mm]", kAxes[index(view.vertical)]),
                {.size = 15, .align = Align::kCentre, .angle = 90.0});
  }
  draw_texts(
      canvas,
      {.title = picture_title(run.name, run.notes),
       .subtitle = fmt::format("field {}: |p| in the plane {} = {:.6g} mm, and its level", field.grid.name,
                               kAxes[index(view.normal)], 1e3 * field.grid.origin[view.normal]),
       .foot = fmt::format("0 dB: {:.4g} kPa, for all methods. Grey: inside a body. White: the target's border, and "
                           "transducers in the plane.",
                           1e-3 * loudest)});
  return canvas.file();
}

Run as_evaluated(Run run) {
  const bool apart = run.evaluation_model && std::ranges::all_of(run.methods, [](const MethodResult& result) {
                       return result.evaluation_pressure.size() != 0 && result.pressure.size() != 0;
                     });
  for (MethodResult& result : run.methods) {
    if (apart) {
      result.pressure = result.evaluation_pressure;
    } else if (run.evaluation_model) {
      result.radiation.resize(0);  // it is of another skin
    }
  }
  if (apart) {
    run.mesh = run.evaluation_model->mesh;
    run.target = run.evaluation_model->target;
  }
  return run;
}

bool has_overview(const Run& run) {
  return run.target ||
         std::ranges::any_of(run.methods, [](const MethodResult& result) { return result.pressure.size() != 0; });
}

namespace {

/// Files' names without their ending, and what draws them.
using NamedPictures = std::vector<std::pair<std::string, std::function<std::string()>>>;

NamedPictures pictures_of(const Run& run) {
  NamedPictures pictures;
  if (has_overview(run)) {
    pictures.emplace_back("overview", [&run] { return overview_picture(run); });
  }
  for (const FieldResult& field : run.fields) {
    if (is_plane(field.grid) && !field.pressure.empty()) {
      pictures.emplace_back("field_" + field.grid.name, [&run, &field] { return field_picture(run, field); });
    }
  }
  return pictures;
}

}  // namespace

std::string draw_figure(const std::string& name, const Run& run) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  std::vector<std::string> names;
  for (const auto& [own, draw] : pictures_of(evaluated)) {
    if (own == name) {
      return draw();
    }
    names.push_back(own);
  }
  throw InputError(fmt::format("run {}: no picture is called '{}'; the pictures are {}", run.name, name,
                               names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

std::vector<std::string> draw_figures(const std::string& directory, const Run& run) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  std::vector<std::string> files;
  for (const auto& [name, draw] : pictures_of(evaluated)) {
    files.push_back((std::filesystem::path(directory) / (name + ".png")).string());
    write_atomically(files.back(), {draw()});
  }
  return files;
}

}  // namespace touchfield
