#include "sim/pictures/skin_picture.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sim/field/target_parts.h"
#include "sim/pictures/picture_parts.h"
#include "sim/run/run_data.h"
#include "sim/run/text_table.h"

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

/// Adds the ends of the lines along which the sides of the target's boxes cut the skin.
void add_borders(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, std::vector<Vector3>& ends) {
  for (const FacePart& part : face_parts(mesh, boxes)) {
    for (std::size_t i = 0; i < part.corners.size(); ++i) {
      const Vector3& a = part.corners[i];
      const Vector3& b = part.corners[(i + 1) % part.corners.size()];
      if (part.borders[i] != 0 && !is_within(boxes, static_cast<std::size_t>(part.box), 0.5 * (a + b))) {
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
  add_borders(mesh, target.boxes, ends);
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
  draw_outline(canvas, panel);
}

void SkinLook::draw_wanted(Canvas& canvas, const Target& target, double top, const PixelBox& panel) const {
  const std::vector<Colour> inside = skin_colours(target.amplitudes, top);
  const Colour outside = skin_colours(Eigen::VectorXd::Zero(1), top).front();
  draw_sight(
      canvas, sight_,
      [&](int face, const Vector3& x) {
        const auto at = std::ranges::lower_bound(target.faces, face);
        const auto k = at - target.faces.begin();
        const bool within = at != target.faces.end() && *at == face &&
                            (target.shares(k) == 1.0 || target.boxes.empty() ||
                             std::ranges::any_of(target.boxes, [&](const TargetBox& box) { return holds(box, x); }));
        return within ? inside[static_cast<std::size_t>(k)] : outside;
      },
      panel);
  draw_outline(canvas, panel);
}

void SkinLook::draw_outline(Canvas& canvas, const PixelBox& panel) const {
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

std::string SkinPictures::picture(const Eigen::VectorXd& values, const SkinScale& scale, const SkinText& text) const {
  const std::vector<Colour> colours = skin_colours(values, scale.top);
  return drawn([&](const SkinLook& look, Canvas& canvas) { look.draw(canvas, colours, look.view().panel); },
               values.maxCoeff(), scale, text);
}

std::string SkinPictures::wanted_picture(double top, const SkinText& text) const {
  const Target& target = run_.target.value();
  return drawn([&](const SkinLook& look, Canvas& canvas) { look.draw_wanted(canvas, target, top, look.view().panel); },
               target.amplitudes.maxCoeff(), {.top = top}, text);
}

std::string SkinPictures::drawn(const std::function<void(const SkinLook&, Canvas&)>& draw, double largest,
                                const SkinScale& scale, const SkinText& text) const {
  Canvas canvas(kPictureWidth, kPictureHeight, format_);
  describe(canvas, run_.provenance);
  draw(body_, canvas);
  draw_scale_bar(canvas, body_.view().panel, body_.view().scale);
  if (target_) {
    draw(*target_, canvas);
    draw_scale_bar(canvas, target_->view().panel, target_->view().scale);
    canvas.frame(target_->view().panel, kFrame, 1.0);
    canvas.frame(footprint(target_->view(), body_.view()), kFrame, 1.0);
  }
  draw_colour_bar(canvas, skin_bar(scale, largest));
  draw_title(canvas, text.title, text.subtitle);
  draw_caption(canvas, text.caption,
               fmt::format("Seen from the array's side. {}{}", text.colours,
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
  Eigen::VectorXd values;  // empty: what is wanted
};

std::vector<Column> columns_of(const Run& run) {
  std::vector<Column> columns;
  if (run.target) {
    columns.push_back({"wanted", fmt::format("{:.3g} kPa", 1e-3 * run.target->amplitudes.maxCoeff()), {}});
  }
  for (const MethodResult& result : run.methods) {
    if (result.pressure.size() != 0) {
      const Metrics& metrics = result.metrics;
      const auto share = [](double error) { return table_number(100.0 * error, "{:.1f}"); };
      columns.push_back({result.name,
                         std::isnan(metrics.relative_error) ? ""
                                                            : "error " + share(metrics.relative_error) + " / " +
                                                                  share(metrics.relative_error_radiation) + " %",
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
      const Eigen::VectorXd& values = columns[static_cast<std::size_t>(column)].values;
      if (values.size() == 0) {
        seen.draw_wanted(canvas, *run.target, top, panel(column, look));
      } else {
        seen.draw(canvas, skin_colours(values, top), panel(column, look));
      }
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
    most = std::max(most, shown.values.size() == 0 ? run.target->amplitudes.maxCoeff() : shown.values.maxCoeff());
  }
  draw_colour_bar(canvas, skin_bar({.top = top}, most));
  draw_title(canvas, picture_title(run.name, run.notes), "pressure on the skin");
  draw_caption(
      canvas, "",
      fmt::format("Seen from the array's side.{}",
                  run.target
                      ? " Green: the border of the target on the skin. Error over the whole skin: of |p| / of the "
                        "radiation pressure."
                      : ""));
  return canvas.file();
}

}  // namespace touchfield
