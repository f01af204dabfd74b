#include "sim/pictures/field_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include <fmt/format.h>

#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"

namespace touchfield {

namespace {

constexpr PixelBox kRoom = {120, 160, 920, 640};
constexpr Colour kBody = {190, 190, 190};
constexpr std::array<char, 3> kAxes = {'x', 'y', 'z'};

/// The extent of the cells around a grid's points along an axis [m].
double extent(const FieldGrid& grid, int axis) {
  return grid.spacing[axis] * grid.count[static_cast<std::size_t>(axis)];
}

/// Ticks along one side of the plane; `place` turns pixels along the axis and away from the plane into a position.
template <class Place>
void draw_axis(Canvas& canvas, const FieldGrid& grid, int axis, int pixels, int most, const TextStyle& style,
               double label_distance, const Place& place) {
  const double low = grid.origin[axis] - 0.5 * grid.spacing[axis];
  const double length = extent(grid, axis);
  const double step = tick_step(length, most);
  for (double i = std::ceil(low / step - 1e-9); i * step <= (low + length) + 1e-9 * step; ++i) {
    const double along = (i * step - low) / length * pixels;
    canvas.line(place(along, 0.0), place(along, 6.0), kInk, 1.0);
    const Eigen::Vector2d at = place(along, label_distance);
    canvas.text(at.x(), at.y(), fmt::format("{:.6g}", std::round(i * step * 1e9) / 1e6 + 0.0), style);
  }
}

}  // namespace

bool is_plane(const FieldGrid& grid) { return std::ranges::count(grid.count, 1) == 1; }

PlaneView plane_view(const FieldGrid& grid) {
  const int normal = static_cast<int>(std::ranges::find(grid.count, 1) - grid.count.begin());
  const int horizontal = normal == 0 ? 1 : 0;
  const int vertical = normal == 2 ? 1 : 2;
  const double width = extent(grid, horizontal);
  const double height = extent(grid, vertical);
  const double scale = std::max(width / kRoom.width, height / kRoom.height);  // [m] a pixel
  const auto pixels = [&](double length) { return std::max(1, static_cast<int>(std::lround(length / scale))); };
  const PixelBox box = {kRoom.x + (kRoom.width - pixels(width)) / 2, kRoom.y + (kRoom.height - pixels(height)) / 2,
                        pixels(width), pixels(height)};
  return {horizontal, vertical, normal, box};
}

std::string field_picture(const Run& run, const FieldResult& field, const Eigen::VectorXcd& pressure, double top,
                          const std::string& subtitle, PictureFormat format) {
  const FieldGrid& grid = field.grid;
  const PlaneView view = plane_view(grid);
  const PixelBox& box = view.box;
  std::array<Eigen::Index, 3> stride = {1, grid.count[0], static_cast<Eigen::Index>(grid.count[0]) * grid.count[1]};
  const auto nearest = [&](int pixel, int pixels, int axis) {
    const auto n = static_cast<Eigen::Index>(grid.count[static_cast<std::size_t>(axis)]);
    return n * (2 * pixel + 1) / (2 * pixels) * stride[static_cast<std::size_t>(axis)];
  };

  Canvas canvas(kPictureWidth, kPictureHeight, format);
  describe(canvas, run.provenance);
  canvas.image(box, [&](int i, int j) {
    const Eigen::Index at = nearest(i, box.width, view.horizontal) + nearest(j, box.height, view.vertical);
    return field.inside[static_cast<std::size_t>(at)] != 0 ? kBody : viridis(std::abs(pressure(at)) / top);
  });
  canvas.frame(box, kInk, 1.0);
  draw_axis(canvas, grid, view.horizontal, box.width, 10, {.size = 16, .align = Align::kCentre}, 20.0,
            [&](double along, double away) { return Eigen::Vector2d(box.x + along, box.y - away); });
  draw_axis(canvas, grid, view.vertical, box.height, 10, {.size = 16, .align = Align::kRight}, 11.0,
            [&](double along, double away) { return Eigen::Vector2d(box.x - away, box.y + along); });
  const auto axis_name = [](int axis) { return fmt::format("{} [mm]", kAxes[static_cast<std::size_t>(axis)]); };
  canvas.text(box.x + 0.5 * box.width, box.y - 48, axis_name(view.horizontal), {.size = 18, .align = Align::kCentre});
  canvas.text(box.x - 66, box.y + 0.5 * box.height, axis_name(view.vertical),
              {.size = 18, .align = Align::kCentre, .angle = 90.0});
  draw_colour_bar(canvas, top);
  draw_title(canvas, run.name, subtitle);
  draw_caption(
      canvas,
      with_label(fmt::format("|p| in the plane {} = {:.6g} mm; grey: inside a body",
                             kAxes[static_cast<std::size_t>(view.normal)], 1e3 * grid.origin[view.normal]),
                 run.has_fields_of_judge() ? run.judged_skin : run.solved_skin),
      fmt::format("Colours from 0 to {:.6g} Pa for every method in this plane; values above are clipped.", top));
  return canvas.file();
}

}  // namespace touchfield
