#include "sim/pictures/skin_picture.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sim/pictures/picture_parts.h"
#include "sim/run/run_data.h"

namespace touchfield {

namespace {

constexpr PixelBox kWhole = {30, 100, 1010, 700};
constexpr PixelBox kLeftPanel = {30, 100, 420, 700};
constexpr PixelBox kRightPanel = {470, 100, 570, 700};
constexpr Colour kFrame = {110, 110, 110};

/// Where the close view lies in the view of the whole body.
PixelBox footprint(const SkinView& close, const SkinView& whole) {
  const Eigen::Vector2d centre = whole.pixel(close.centre);
  const double shrink = close.scale / whole.scale;
  const auto pixels = [](double length) { return static_cast<int>(std::lround(length)); };
  return {pixels(centre.x() - 0.5 * shrink * close.panel.width), pixels(centre.y() - 0.5 * shrink * close.panel.height),
          pixels(shrink * close.panel.width), pixels(shrink * close.panel.height)};
}

/// Moves a close view so that its footprint stays in the panel of the whole body.
SkinView inside(SkinView close, const SkinView& whole) {
  const PixelBox box = footprint(close, whole);
  const auto shift = [](int low, int size, int panel_low, int panel_size) {
    return std::max(panel_low - low, 0) + std::min(panel_low + panel_size - (low + size), 0);
  };
  const PixelBox& panel = whole.panel;
  close.centre += whole.scale * (shift(box.x, box.width, panel.x, panel.width) * close.right() +
                                 shift(box.y, box.height, panel.y, panel.height) * close.up);
  return close;
}

/// Adds the ends of the sides of faces of the target that one of them alone has: of those in masks, and of all if the
/// target does not say its boxes.
void add_sides(const TriangleMesh& mesh, const Target& target, std::vector<Vector3>& ends) {
  std::map<std::pair<int, int>, int> uses;
  for (std::size_t k = 0; k < target.faces.size(); ++k) {
    const bool sided =
        target.boxes.empty() || target.boxes[static_cast<std::size_t>(target.box[k])].shape == TargetShape::kMask;
    for (int c = 0; c < 3 && sided; ++c) {
      ++uses[std::minmax({mesh.triangles()(c, target.faces[k]), mesh.triangles()((c + 1) % 3, target.faces[k])})];
    }
  }
  for (const auto& [edge, count] : uses) {
    if (count == 1) {
      ends.insert(ends.end(), {mesh.vertices().col(edge.first), mesh.vertices().col(edge.second)});
    }
  }
}

/// The part of a line from a to b that has |x| <= half along an axis; false if none is left.
bool clip(Vector3& a, Vector3& b, int axis, double half) {
  for (const double side : {-1.0, 1.0}) {
    const double from = half - side * a[axis];
    const double to = half - side * b[axis];
    if (from < 0 && to < 0) {
      return false;
    }
    if (from < 0) {
      a += from / (from - to) * (b - a);
    } else if (to < 0) {
      b += to / (to - from) * (a - b);
    }
  }
  return true;
}

/// The ends of the line along which the plane x[axis] = place cuts a face; empty if it does not.
std::vector<Vector3> cut_of_face(const Eigen::Matrix3d& corners, int axis, double place) {
  std::vector<Vector3> cut;
  for (int c = 0; c < 3; ++c) {
    const Vector3 a = corners.col(c);
    const Vector3 b = corners.col((c + 1) % 3);
    if ((a[axis] < place) != (b[axis] < place)) {
      cut.emplace_back(a + (place - a[axis]) / (b[axis] - a[axis]) * (b - a));
    }
  }
  return cut;
}

/// The ends of the line along which the cylinder of this radius about z cuts a face, as a straight one; empty if no
/// two sides cross it.
std::vector<Vector3> round_cut_of_face(const Eigen::Matrix3d& corners, double radius) {
  std::vector<Vector3> cut;
  for (int c = 0; c < 3; ++c) {
    const Vector3 a = corners.col(c);
    const Vector3 way = corners.col((c + 1) % 3) - a;
    const double from = a.head<2>().squaredNorm() - radius * radius;
    const double to = (a + way).head<2>().squaredNorm() - radius * radius;
    if ((from < 0) != (to < 0)) {  // |a + t way| = radius has one root between
      const double along = way.head<2>().squaredNorm();
      const double half = a.head<2>().dot(way.head<2>());
      const double root = std::sqrt(std::max(half * half - along * from, 0.0));
      cut.emplace_back(a + (from < 0 ? root - half : -half - root) / along * way);
    }
  }
  return cut;
}

/// The ends of the lines along which a box's sides cut a face, both in the box's own frame, from its centre.
std::vector<Vector3> cuts_of_face(const Eigen::Matrix3d& corners, const TargetBox& box) {
  const Vector3 half = 0.5 * box.size;
  const bool is_round = box.shape == TargetShape::kCylinder;
  std::vector<Vector3> ends;
  for (int side = is_round ? 4 : 0; side < 6; ++side) {
    const int axis = side / 2;
    std::vector<Vector3> cut = cut_of_face(corners, axis, side % 2 == 0 ? half[axis] : -half[axis]);
    if (!cut.empty() && clip(cut[0], cut[1], (axis + 1) % 3, half[(axis + 1) % 3]) &&
        clip(cut[0], cut[1], (axis + 2) % 3, half[(axis + 2) % 3]) &&
        (!is_round || (0.5 * (cut[0] + cut[1])).head<2>().norm() <= half.x())) {
      ends.insert(ends.end(), cut.begin(), cut.end());
    }
  }
  if (is_round) {
    std::vector<Vector3> cut = round_cut_of_face(corners, half.x());
    if (!cut.empty() && clip(cut[0], cut[1], 2, half.z())) {
      ends.insert(ends.end(), cut.begin(), cut.end());
    }
  }
  return ends;
}

/// Whether a point of a box's sides is no border of the target: in a box before, whose faces are that one's, or in a
/// box behind of the same pressure. Where the sides of two pieces of a line fall together, those of the first are.
bool is_within(const std::vector<TargetBox>& boxes, std::size_t box, const Vector3& x) {
  constexpr double kBefore = 1.001;  // of a box
  constexpr double kBehind = 0.98;
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    if (b != box && (b < box || boxes[b].level == boxes[box].level)) {
      TargetBox inside = boxes[b];
      inside.size *= b < box ? kBefore : kBehind;
      if (holds(inside, x)) {
        return true;
      }
    }
  }
  return false;
}

/// Adds the ends of the lines along which the sides of one of the target's boxes cut the faces of a mesh.
void add_section(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, std::size_t number,
                 std::vector<Vector3>& ends) {
  const TargetBox& box = boxes[number];
  const Points own = box.rotation.transpose() * (mesh.vertices().colwise() - box.centre);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    Eigen::Matrix3d corners;
    corners << own.col(mesh.triangles()(0, f)), own.col(mesh.triangles()(1, f)), own.col(mesh.triangles()(2, f));
    const std::vector<Vector3> cuts = cuts_of_face(corners, box);
    for (std::size_t i = 0; i < cuts.size(); i += 2) {
      const Vector3 a = box.centre + box.rotation * cuts[i];
      const Vector3 b = box.centre + box.rotation * cuts[i + 1];
      if (!is_within(boxes, number, 0.5 * (a + b))) {
        ends.insert(ends.end(), {a, b});
      }
    }
  }
}

}  // namespace

SkinPanels skin_panels(const Run& run) {
  constexpr double kBodyShare = 0.94;
  constexpr double kTargetShare = 0.6;
  constexpr double kWorthACloseView = 0.6;  // of the body's scale
  const Points& vertices = run.mesh.vertices();
  const Vector3 direction = facing(run.array, run.mesh.centroids().rowwise().mean());
  if (run.target) {
    const SkinView whole = fitted_view(kLeftPanel, direction, vertices, kBodyShare);
    const SkinView close = fitted_view(kRightPanel, direction, target_corners(run.mesh, *run.target), kTargetShare);
    if (close.scale < kWorthACloseView * whole.scale) {
      return {whole, inside(close, whole)};
    }
  }
  return {fitted_view(kWhole, direction, vertices, kBodyShare), std::nullopt};
}

Points target_corners(const TriangleMesh& mesh, const Target& target) {
  Points corners(3, 3 * target.size());
  for (Eigen::Index k = 0; k < target.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      corners.col(3 * k + c) = mesh.corner(target.faces[static_cast<std::size_t>(k)], c);
    }
  }
  return corners;
}

Lines target_outline(const TriangleMesh& mesh, const Target& target) {
  std::vector<Vector3> ends;
  add_sides(mesh, target, ends);
  for (std::size_t b = 0; b < target.boxes.size(); ++b) {
    if (target.boxes[b].shape != TargetShape::kMask) {
      add_section(mesh, target.boxes, b, ends);
    }
  }
  Lines lines{Points(3, static_cast<Eigen::Index>(ends.size())),
              Eigen::Matrix2Xi(2, static_cast<Eigen::Index>(ends.size() / 2))};
  for (std::size_t i = 0; i < ends.size(); ++i) {
    lines.points.col(static_cast<Eigen::Index>(i)) = ends[i];
    lines.ends(static_cast<Eigen::Index>(i % 2), static_cast<Eigen::Index>(i / 2)) = static_cast<int>(i);
  }
  return lines;
}

Lines box_edges(const std::vector<TargetBox>& boxes) {
  const auto count = static_cast<Eigen::Index>(boxes.size());
  Lines lines{Points(3, 8 * count), Eigen::Matrix2Xi(2, 12 * count)};
  Eigen::Index e = 0;
  for (Eigen::Index b = 0; b < count; ++b) {
    const TargetBox& box = boxes[static_cast<std::size_t>(b)];
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 sign((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.5 : -0.5,
                         (corner & 4) != 0 ? 0.5 : -0.5);
      lines.points.col(8 * b + corner) = box.centre + box.rotation * sign.cwiseProduct(box.size);
      for (const int axis : {1, 2, 4}) {
        if ((corner & axis) == 0) {
          lines.ends.col(e++) << static_cast<int>(8 * b) + corner, static_cast<int>(8 * b) + corner + axis;
        }
      }
    }
  }
  return lines;
}

SkinLook::SkinLook(const SkinView& view, const TriangleMesh& mesh, const std::optional<Target>& target)
    : sight_(view, mesh) {
  if (target) {
    const Lines lines = target_outline(mesh, *target);
    outline_ = sight_.visible(lines.points, lines.ends);
  }
}

void SkinLook::draw(Canvas& canvas, const std::vector<Colour>& colours, const PixelBox& panel) const {
  draw_sight(canvas, sight_, colours, panel);
  const Eigen::Vector2d shift(panel.x - view().panel.x, panel.y - view().panel.y);
  for (const auto& [colour, width] : {std::pair{kPaper, 4.0}, {kTargetColour, 2.0}}) {
    for (std::size_t i = 0; i < outline_.size(); i += 2) {
      canvas.path({outline_[i] + shift, outline_[i + 1] + shift}, colour, width);
    }
  }
}

SkinPictures::SkinPictures(const Run& run, PictureFormat format)
    : run_(run), format_(format), body_(skin_panels(run).body, run.mesh, run.target) {
  if (const auto close = skin_panels(run).target) {
    target_.emplace(*close, run.mesh, run.target);
  }
}

std::string SkinPictures::picture(const Eigen::VectorXd& values, double top, const SkinText& text) const {
  const std::vector<Colour> colours = skin_colours(values, top);
  Canvas canvas(kPictureWidth, kPictureHeight, format_);
  describe(canvas, run_.provenance);
  body_.draw(canvas, colours, body_.view().panel);
  draw_scale_bar(canvas, body_.view().panel, body_.view().scale);
  if (target_) {
    target_->draw(canvas, colours, target_->view().panel);
    draw_scale_bar(canvas, target_->view().panel, target_->view().scale);
    canvas.frame(target_->view().panel, kFrame, 1.0);
    canvas.frame(footprint(target_->view(), body_.view()), kFrame, 1.0);
  }
  draw_colour_bar(canvas, skin_bar(top, quantile({values.begin(), values.end()}, 1.0)));
  draw_title(canvas, text.title, text.subtitle);
  draw_caption(canvas, text.caption,
               fmt::format("Seen from the array's side. All pictures of this run's skin share these colours.{}",
                           run_.target ? " Green: the border of the target on the skin." : ""));
  return canvas.file();
}

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
    const Points points = all ? run.mesh.vertices() : target_corners(run.mesh, *run.target);
    const SkinLook seen(fitted_view(panel(0, look), panels.body.direction, points, all ? 0.94 : 0.6), run.mesh,
                        run.target);
    for (int column = 0; column < count; ++column) {
      seen.draw(canvas, skin_colours(columns[static_cast<std::size_t>(column)].values, top), panel(column, look));
      canvas.frame(panel(column, look), {170, 170, 170}, 1.0);
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
