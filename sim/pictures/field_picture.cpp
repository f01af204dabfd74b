#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <vector>

#include <fmt/format.h>

#include "sim/pictures/canvas.h"
#include "sim/pictures/figures.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"

namespace touchfield {

namespace {

constexpr PixelBox kPlaneRoom = {20, 84, 1160, 732};  // of both panels with their axes and colour bars
constexpr int kAxisLeft = 92;                         // of a panel: its axis
constexpr int kBarRight = 116;                        // its colour bar
constexpr int kAxisBelow = 64;                        // its axis
constexpr int kLabelAbove = 56;                       // the name of its colours
constexpr double kLowestLevel = -40.0;                // [dB]
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
  for (const double tick : even_ticks(low, low + length, most)) {
    const double along = (tick - low) / length * pixels;
    canvas.line(place(along, 0.0), place(along, 6.0), kInk, 1.0);
    const Eigen::Vector2d at = place(along, label_distance);
    canvas.text(at.x(), at.y(), fmt::format("{:.6g}", std::round(tick * 1e9) / 1e6 + 0.0), style);
  }
}

/// A plane's own two axes of a point [m].
Eigen::Vector2d in_plane(const PlaneView& view, const Vector3& point) {
  return {point[view.horizontal], point[view.vertical]};
}

/// Where points of a plane are in a panel.
class PanelPlace {
 public:
  PanelPlace(const FieldGrid& grid, const PlaneView& view, const PixelBox& box)
      : low_(in_plane(view, grid.origin - 0.5 * grid.spacing)),
        size_(extent(grid, view.horizontal), extent(grid, view.vertical)),
        corner_(box.x, box.y),
        pixels_(box.width, box.height) {}

  /// The lower left corner is (0, 0), the upper right one (1, 1).
  Eigen::Vector2d share(const Eigen::Vector2d& at) const { return (at - low_).cwiseQuotient(size_); }
  Eigen::Vector2d pixel(const Eigen::Vector2d& at) const { return corner_ + share(at).cwiseProduct(pixels_); }
  bool holds(const Eigen::Vector2d& at) const {
    return (share(at).array() >= 0.0).all() && (share(at).array() <= 1.0).all();
  }

 private:
  Eigen::Vector2d low_;
  Eigen::Vector2d size_;
  Eigen::Vector2d corner_;
  Eigen::Vector2d pixels_;
};

/// The corners of the polygon in which a plane cuts a box, in turn; empty if it does not.
std::vector<Eigen::Vector2d> cut_of_box(const PlaneView& view, double place, const TargetBox& box) {
  const Lines edges = box_edges({box});
  std::vector<Eigen::Vector2d> corners;
  for (Eigen::Index e = 0; e < edges.ends.cols(); ++e) {
    const Vector3 a = edges.points.col(edges.ends(0, e));
    const Vector3 b = edges.points.col(edges.ends(1, e));
    if ((a[view.normal] < place) != (b[view.normal] < place)) {
      corners.push_back(in_plane(view, a + (place - a[view.normal]) / (b[view.normal] - a[view.normal]) * (b - a)));
    }
  }
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : corners) {
    middle += corner / static_cast<double>(corners.size());
  }
  std::ranges::sort(corners, {}, [&](const Eigen::Vector2d& corner) {
    const Eigen::Vector2d from = corner - middle;
    return std::atan2(from.y(), from.x());
  });
  return corners;
}

void draw_boxes(Canvas& canvas, const Run& run, const FieldGrid& grid, const PlaneView& view, const PanelPlace& place) {
  if (!run.target) {
    return;
  }
  for (const TargetBox& box : run.target->boxes) {
    const std::vector<Eigen::Vector2d> corners = cut_of_box(view, grid.origin[view.normal], box);
    for (std::size_t i = 0; i < corners.size() && box.shape != TargetShape::kMask; ++i) {
      const Eigen::Vector2d& a = corners[i];
      const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
      if (place.holds(a) && place.holds(b)) {
        canvas.path({place.pixel(a), place.pixel(b)}, kPaper, 1.5);
      }
    }
  }
}

/// The transducers that lie in the panel; returns whether there is one.
bool draw_transducers(Canvas& canvas, const TransducerArray& array, const FieldGrid& grid, const PlaneView& view,
                      const PanelPlace& place) {
  constexpr double kNear = 5e-3;  // [m] of the plane: half of a pitch of usual arrays
  constexpr double kHalf = 4.0;   // [pixels]
  bool any = false;
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    const Vector3 at = array.positions.col(n);
    const Eigen::Vector2d flat = in_plane(view, at);
    if (std::abs(at[view.normal] - grid.origin[view.normal]) > kNear || !place.holds(flat)) {
      continue;
    }
    any = true;
    const Eigen::Vector2d across = kHalf * in_plane(view, array.axes.col(n)).unitOrthogonal();
    canvas.line(place.pixel(flat) - across, place.pixel(flat) + across, kPaper, 3.0);
  }
  return any;
}

/// How far the array's middle is from the plane's, and on which side.
std::string way_to_array(const TransducerArray& array, const FieldGrid& grid) {
  if (array.kind != TransducerArray::Kind::kTransducers) {
    return "";
  }
  const Vector3 last = Eigen::Array3d(grid.count[0], grid.count[1], grid.count[2]) - 1.0;
  const Vector3 middle = grid.origin + 0.5 * grid.spacing.cwiseProduct(last);
  const Vector3 way = array.positions.rowwise().mean() - middle;
  Eigen::Index axis = 0;
  way.cwiseAbs().maxCoeff(&axis);
  return fmt::format(" The array's middle is {:.0f} mm from the plane's, towards {}{}.", 1e3 * way.norm(),
                     way[axis] < 0 ? '-' : '+', kAxes[static_cast<std::size_t>(axis)]);
}

void draw_axes(Canvas& canvas, const FieldGrid& grid, const PlaneView& view, const PixelBox& box) {
  canvas.frame(box, kInk, 1.0);
  const auto ticks = [](int pixels) { return std::clamp(pixels / 60, 2, 10); };
  draw_axis(canvas, grid, view.horizontal, box.width, ticks(box.width), {.size = 15, .align = Align::kCentre}, 18.0,
            [&](double along, double away) { return Eigen::Vector2d(box.x + along, box.y - away); });
  draw_axis(canvas, grid, view.vertical, box.height, ticks(box.height), {.size = 15, .align = Align::kRight}, 10.0,
            [&](double along, double away) { return Eigen::Vector2d(box.x - away, box.y + along); });
  const auto axis_name = [](int axis) { return fmt::format("{} [mm]", kAxes[static_cast<std::size_t>(axis)]); };
  canvas.text(box.x + 0.5 * box.width, box.y - 42, axis_name(view.horizontal), {.size = 16, .align = Align::kCentre});
  canvas.text(box.x - 62, box.y + 0.5 * box.height, axis_name(view.vertical),
              {.size = 16, .align = Align::kCentre, .angle = 90.0});
}

}  // namespace

bool is_plane(const FieldGrid& grid) { return std::ranges::count(grid.count, 1) == 1; }

PlaneView plane_view(const FieldGrid& grid) {
  const int normal = static_cast<int>(std::ranges::find(grid.count, 1) - grid.count.begin());
  const int horizontal = normal == 0 ? 1 : 0;
  const int vertical = normal == 2 ? 1 : 2;
  const double width = extent(grid, horizontal);
  const double height = extent(grid, vertical);
  const auto scale_in = [&](const PixelBox& cell) {  // [pixels] a metre
    return std::min((cell.width - kAxisLeft - kBarRight) / width, (cell.height - kAxisBelow - kLabelAbove) / height);
  };
  const PixelBox column = {0, 0, kPlaneRoom.width / 2, kPlaneRoom.height};
  const PixelBox row = {0, 0, kPlaneRoom.width, kPlaneRoom.height / 2};
  const bool beside = scale_in(column) >= scale_in(row);
  const PixelBox& cell = beside ? column : row;
  const auto pixels = [&](double length) {
    return std::max(1, static_cast<int>(std::lround(length * scale_in(cell))));
  };
  PixelBox box = {0, 0, pixels(width), pixels(height)};
  box.x = kPlaneRoom.x + kAxisLeft + (cell.width - kAxisLeft - kBarRight - box.width) / 2;
  box.y = kPlaneRoom.y + kAxisBelow + (cell.height - kAxisBelow - kLabelAbove - box.height) / 2;
  PixelBox other = box;
  (beside ? other.x : box.y) += beside ? column.width : row.height;
  return {horizontal, vertical, normal, box, other};
}

std::string field_picture(const Run& run, const FieldResult& field, const Eigen::VectorXcd& pressure,
                          const FieldTops& tops, const std::string& subtitle, PictureFormat format) {
  const FieldGrid& grid = field.grid;
  const PlaneView view = plane_view(grid);
  const std::array<Eigen::Index, 3> stride = {1, grid.count[0],
                                              static_cast<Eigen::Index>(grid.count[0]) * grid.count[1]};
  const auto nearest = [&](int pixel, int pixels, int axis) {
    const auto n = static_cast<Eigen::Index>(grid.count[static_cast<std::size_t>(axis)]);
    return n * (2 * pixel + 1) / (2 * pixels) * stride[static_cast<std::size_t>(axis)];
  };
  double most = 0.0;
  for (Eigen::Index i = 0; i < pressure.size(); ++i) {
    most = field.inside[static_cast<std::size_t>(i)] != 0 ? most : std::max(most, std::abs(pressure(i)));
  }

  Canvas canvas(kPictureWidth, kPictureHeight, format);
  describe(canvas, run.provenance);
  bool transducers = false;
  const auto draw_panel = [&](const PixelBox& box, ColourBar bar, const auto& value) {
    canvas.image(box, [&](int i, int j) {
      const Eigen::Index at = nearest(i, box.width, view.horizontal) + nearest(j, box.height, view.vertical);
      return field.inside[static_cast<std::size_t>(at)] != 0
                 ? kBody
                 : bar.map((value(std::abs(pressure(at))) - bar.bottom) / (bar.top - bar.bottom));
    });
    const PanelPlace place(grid, view, box);
    draw_boxes(canvas, run, grid, view, place);
    transducers = draw_transducers(canvas, run.array, grid, view, place) || transducers;
    draw_axes(canvas, grid, view, box);
    bar.box = {box.x + box.width + 18, box.y, 20, box.height};
    draw_colour_bar(canvas, bar);
  };
  draw_panel(view.linear, {.label = "|p| [kPa]", .top = 1e-3 * tops.own, .most = 1e-3 * most},
             [](double p) { return 1e-3 * p; });
  draw_panel(view.level, {.label = "level [dB]", .bottom = kLowestLevel, .top = 0.0},
             [&](double p) { return 20.0 * std::log10(std::max(p / tops.loudest, 1e-30)); });
  draw_title(canvas, picture_title(run.name, run.notes), subtitle);
  const std::string legend =
      fmt::format(" White: {}.", transducers ? "transducers, and the target's box" : "the target's box");
  draw_caption(canvas,
               fmt::format("|p| in the plane {} = {:.6g} mm; grey: inside a body",
                           kAxes[static_cast<std::size_t>(view.normal)], 1e3 * grid.origin[view.normal]),
               fmt::format("0 dB: {:.4g} kPa, for all methods.{}{}", 1e-3 * tops.loudest,
                           transducers ? "" : way_to_array(run.array, grid),
                           run.target && !run.target->boxes.empty() ? legend : ""));
  return canvas.file();
}

}  // namespace touchfield
