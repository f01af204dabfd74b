#include "sim/pictures/skin_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sim/field/target_parts.h"

namespace touchfield {

namespace {

constexpr int kSamples = 4;       // a pixel, along each side
constexpr double kAmbient = 0.7;  // the share of a face's colour that shading leaves alone
constexpr double kCrease = 0.8;   // cosine of the angle between a face and its vertices from which on it is flat

/// Columns: right, up, along the direction of sight.
Eigen::Matrix3d view_axes(const Vector3& direction) {
  constexpr double kParallel = 0.99;
  const Vector3 vertical = std::abs(direction.y()) < kParallel ? Vector3::UnitY() : Vector3::UnitX();
  const Vector3 up = (vertical - vertical.dot(direction) * direction).normalized();
  Eigen::Matrix3d axes;
  axes << direction.cross(up), up, direction;
  return axes;
}

Camera camera_of(const SkinView& view) {
  Camera camera;
  camera.projection = Camera::Projection::kOrthographic;
  camera.width = kSamples * view.panel.width;
  camera.height = kSamples * view.panel.height;
  camera.eye = view.centre;
  camera.axes << view.right(), -view.up, view.direction;
  camera.focal.setConstant(kSamples / view.scale);
  camera.centre << 0.5 * camera.width, 0.5 * camera.height;
  camera.near = -HUGE_VAL;
  return camera;
}

/// True if none of the samples round a place sees only what is nearer than it.
bool seen_at(const Raster& raster, const SeenPoint& place) {
  const int column = static_cast<int>(std::floor(place[0]));
  const int row = static_cast<int>(std::floor(place[1]));
  if (column < 1 || row < 1 || column + 1 >= raster.width || row + 1 >= raster.height) {
    return false;
  }
  double farthest = -HUGE_VAL;
  for (int j = row - 1; j <= row + 1; ++j) {
    for (int i = column - 1; i <= column + 1; ++i) {
      farthest = std::max(farthest, raster.depth[raster.index(i, j)]);
    }
  }
  constexpr double kSlack = 1e-6;  // [m], for edges along faces seen head-on
  return place[3] <= farthest + kSlack;
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

Eigen::Vector2d SkinView::pixel(const Vector3& point) const {
  const Vector3 offset = (point - centre) / scale;
  return {panel.x + 0.5 * panel.width + offset.dot(right()), panel.y + 0.5 * panel.height + offset.dot(up)};
}

Vector3 facing(const TransducerArray& array, const Vector3& centre) {
  constexpr double kCancelled = 1e-3;  // of the mean of unit vectors: no direction is left in it
  const Vector3 axis = array.axes.rowwise().mean();
  if (axis.norm() > kCancelled) {
    return axis.normalized();
  }
  const Vector3 across = centre - array.positions.rowwise().mean();
  return across.norm() > 0 ? across.normalized() : Vector3::UnitZ();
}

Eigen::Vector2d seen_size(const Vector3& direction, const Points& points) {
  const Points seen = view_axes(direction).transpose() * points;
  return (seen.rowwise().maxCoeff() - seen.rowwise().minCoeff()).head<2>();
}

SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Points& points, double share) {
  const Eigen::Matrix3d axes = view_axes(direction);
  const Points seen = axes.transpose() * points;
  const Eigen::Vector2d size = seen_size(direction, points);
  return {.panel = panel,
          .direction = direction,
          .up = axes.col(1),
          .centre = axes * (0.5 * (seen.rowwise().minCoeff() + seen.rowwise().maxCoeff())),
          .scale = std::max(size.x() / panel.width, size.y() / panel.height) / share};
}

Eigen::MatrixXd vertex_means(const TriangleMesh& mesh, const Eigen::MatrixXd& of_faces) {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(of_faces.rows(), mesh.vertex_count());
  Eigen::RowVectorXd areas = Eigen::RowVectorXd::Zero(mesh.vertex_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3 && of_faces.col(f).allFinite(); ++c) {
      sums.col(mesh.triangles()(c, f)) += mesh.areas()(f) * of_faces.col(f);
      areas(mesh.triangles()(c, f)) += mesh.areas()(f);
    }
  }
  return sums.array().rowwise() / areas.array();
}

SkinLook::SkinLook(const SkinView& view, const TriangleMesh& mesh, const std::optional<Target>& target)
    : view_(view),
      mesh_(mesh),
      camera_(camera_of(view)),
      seen_(seen_points(camera_, mesh.vertices())),
      raster_(rasterise(camera_, mesh.vertices(), mesh.triangles())),
      shade_(raster_.face.size()),
      outline_(target ? visible(target_outline(mesh, *target)) : std::vector<Eigen::Vector2d>{}) {
  const Points normals = vertex_means(mesh, mesh.normals()).colwise().normalized();
#pragma omp parallel for schedule(static)
  for (int row = 0; row < raster_.height; ++row) {
    for (int column = 0; column < raster_.width; ++column) {
      const std::size_t at = raster_.index(column, row);
      if (const int face = raster_.face[at]; face != Raster::kNothing) {
        const Vector3 flat = mesh.normals().col(face);
        const Vector3 smooth =
            (normals(Eigen::all, mesh.triangles().col(face)) * shares(face, {column + 0.5, row + 0.5})).normalized();
        const double cosine = std::abs(view.direction.dot(smooth.dot(flat) > kCrease ? smooth : flat));
        shade_[at] = static_cast<std::uint8_t>(std::lround(255.0 * (kAmbient + (1.0 - kAmbient) * cosine)));
      }
    }
  }
}

Vector3 SkinLook::shares(int face, const Eigen::Vector2d& sample) const {
  const auto corners = mesh_.triangles().col(face);
  const Eigen::Vector2d first = seen_.col(corners[0]).head<2>();
  Eigen::Matrix2d sides;
  sides << seen_.col(corners[1]).head<2>() - first, seen_.col(corners[2]).head<2>() - first;
  const Eigen::Vector2d along = sides.inverse() * (sample - first);
  return {1.0 - along.sum(), along[0], along[1]};
}

Colour SkinLook::pixel(int i, int j, const ColourAt& colour_at) const {
  constexpr int kWhole = 255 * kSamples * kSamples;
  const int left = kSamples * i;
  const int top = kSamples * (view_.panel.height - 1 - j);
  std::array<int, 3> sum = {kWhole / 2, kWhole / 2, kWhole / 2};  // to the nearest
  for (int row = top; row < top + kSamples; ++row) {
    for (int column = left; column < left + kSamples; ++column) {
      const std::size_t at = raster_.index(column, row);
      const int face = raster_.face[at];
      const bool skin = face != Raster::kNothing;
      const Colour colour = skin ? colour_at(face, shares(face, {column + 0.5, row + 0.5})) : kPaper;
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += (skin ? shade_[at] : 255) * colour[c];
      }
    }
  }
  Colour mean{};
  std::ranges::transform(sum, mean.begin(), [](int value) { return static_cast<std::uint8_t>(value / kWhole); });
  return mean;
}

std::vector<Eigen::Vector2d> SkinLook::visible(const Points& ends) const {
  constexpr double kPiece = 0.5 * kSamples;  // [samples]
  std::vector<Eigen::Vector2d> found;
  const SeenPoints seen = seen_points(camera_, ends);
  for (Eigen::Index e = 0; e < ends.cols(); e += 2) {
    const SeenPoint along = seen.col(e + 1) - seen.col(e);
    const int pieces = std::max(1, static_cast<int>(std::ceil(along.head<2>().norm() / kPiece)));
    const auto pixel = [&](int piece) {
      return view_.pixel(ends.col(e) + (static_cast<double>(piece) / pieces) * (ends.col(e + 1) - ends.col(e)));
    };
    int begin = -1;
    for (int piece = 0; piece <= pieces; ++piece) {
      const bool open = piece < pieces && seen_at(raster_, seen.col(e) + (piece + 0.5) / pieces * along);
      if (open && begin < 0) {
        begin = piece;
      } else if (!open && begin >= 0) {
        found.insert(found.end(), {pixel(begin), pixel(piece)});
        begin = -1;
      }
    }
  }
  return found;
}

Points target_corners(const TriangleMesh& mesh, const Target& target) {
  return mesh.vertices()(Eigen::all, mesh.triangles()(Eigen::all, target.faces).reshaped());
}

Points target_outline(const TriangleMesh& mesh, const Target& target) {
  std::vector<Vector3> ends;
  add_sides(mesh, target, ends);
  add_borders(mesh, target.boxes, ends);
  Points lines(3, static_cast<Eigen::Index>(ends.size()));
  std::copy(ends.begin(), ends.end(), lines.colwise().begin());
  return lines;
}

double skin_top(double most_wanted, double most) {
  return round_above(most_wanted > 0 ? std::clamp(most, most_wanted, 2.0 * most_wanted) : most);
}

ColourBar skin_bar(const std::string& label, double most_wanted, const std::vector<Eigen::VectorXd>& methods) {
  ColourBar bar{.label = label, .map = skin_colour, .most = most_wanted};
  double top = 0.0;
  double least = 0.0;
  for (const Eigen::VectorXd& values : methods) {
    const std::vector<double> all(values.begin(), values.end());
    top = std::max(top, quantile(all, kTopShare));
    least = std::min(least, quantile(all, 1.0 - kTopShare));
    bar.most = std::max(bar.most, quantile(all, 1.0));
  }
  bar.top = skin_top(most_wanted, top);
  bar.bottom = least < 0.0 ? -std::min(round_above(-least), bar.top) : 0.0;
  return bar;
}

void SkinLook::draw(Canvas& canvas, const Eigen::VectorXd& values, double top, const PixelBox& panel) const {
  const Eigen::MatrixXd corners = vertex_means(mesh_, values.transpose());
  paint(
      canvas,
      [&](int face, const Vector3& shares) {
        const double value = corners(0, mesh_.triangles().col(face)).dot(shares);
        return skin_colour(std::isfinite(values(face)) ? value / top : kNotComputed);
      },
      panel);
}

void SkinLook::draw_wanted(Canvas& canvas, const Target& target, const Eigen::VectorXd& wanted, double top,
                           const PixelBox& panel) const {
  const bool smooth = !target.boxes.empty() && std::ranges::all_of(target.boxes, [&](const TargetBox& box) {
    return box.shape != TargetShape::kMask && box.level == target.boxes.front().level;
  });
  Eigen::RowVectorXd on_target = Eigen::RowVectorXd::Constant(mesh_.face_count(), kNotComputed);
  on_target(target.faces) = wanted.transpose();
  const Eigen::MatrixXd corners = vertex_means(mesh_, on_target);
  paint(
      canvas,
      [&](int face, const Vector3& shares) {
        const auto triangle = mesh_.triangles().col(face);
        const Vector3 x = mesh_.vertices()(Eigen::all, triangle) * shares;
        const auto at = std::ranges::lower_bound(target.faces, face);
        const auto k = at - target.faces.begin();
        const bool within = at != target.faces.end() && *at == face &&
                            (target.shares(k) == 1.0 || target.boxes.empty() ||
                             std::ranges::any_of(target.boxes, [&](const TargetBox& box) { return holds(box, x); }));
        return skin_colour(!within ? 0.0 : (smooth ? corners(0, triangle).dot(shares) : wanted(k)) / top);
      },
      panel);
}

void SkinLook::paint(Canvas& canvas, const ColourAt& colour_at, const PixelBox& panel) const {
  canvas.image(panel, [&](int i, int j) { return pixel(i, j, colour_at); });
  const Eigen::Vector2d shift(panel.x - view_.panel.x, panel.y - view_.panel.y);
  for (const auto& [colour, width] : {std::pair{kPaper, 4.0}, {kTargetColour, 2.0}}) {
    for (std::size_t i = 0; i < outline_.size(); i += 2) {
      canvas.path({outline_[i] + shift, outline_[i + 1] + shift}, colour, width);
    }
  }
  canvas.frame(panel, {170, 170, 170}, 1.0);
}

namespace {

constexpr int kHeadings = 64;  // room of the texts above a panel
constexpr int kName = 26;      // room of a name alone

/// A method, or what is wanted.
struct OverviewColumn {
  std::string name;
  std::string error;
  std::string width;
  Eigen::VectorXd values;  // P [Pa] or |p| [kPa]
};

bool shows_radiation(const Run& run) {
  return std::isfinite(run.radiation_per_square) && std::ranges::all_of(run.methods, [](const MethodResult& result) {
           return result.radiation.size() == result.pressure.size();
         });
}

std::vector<OverviewColumn> columns_of(const Run& run) {
  const bool radiation = shows_radiation(run);
  const auto width = [](double mm) { return std::isnan(mm) ? "" : fmt::format("width {:.1f} mm", mm); };
  std::vector<OverviewColumn> columns;
  if (run.target) {
    const Eigen::VectorXd& amplitudes = run.target->amplitudes;
    const Eigen::VectorXd wanted = radiation ? Eigen::VectorXd(run.radiation_per_square * amplitudes.cwiseAbs2())
                                             : Eigen::VectorXd(1e-3 * amplitudes);
    columns.push_back({"wanted", fmt::format("{:.3g} {}", wanted.maxCoeff(), radiation ? "Pa" : "kPa"),
                       run.methods.empty() ? "" : width(run.methods.front().metrics.width_wanted_mm), wanted});
  }
  for (const MethodResult& result : run.methods) {
    if (result.pressure.size() != 0) {
      const Metrics& metrics = result.metrics;
      const double error = radiation ? metrics.relative_error_radiation : metrics.relative_error;
      columns.push_back({result.name, std::isnan(error) ? "" : fmt::format("error {:.1f} %", 100.0 * error),
                         width(radiation ? metrics.width_radiation_mm : metrics.width_mm),
                         radiation ? result.radiation : Eigen::VectorXd(1e-3 * result.pressure.cwiseAbs())});
    }
  }
  return columns;
}

void draw_headings(Canvas& canvas, const PixelBox& panel, int room, const OverviewColumn& column) {
  const double middle = panel.x + 0.5 * panel.width;
  double y = panel.y + panel.height + room - 13.0;
  draw_fitted(canvas, middle, y, column.name, {.size = 18, .align = Align::kCentre, .bold = true}, panel.width);
  if (room == kHeadings) {
    for (const std::string& text : {column.error, column.width}) {
      draw_fitted(canvas, middle, y -= 19.0, text, {.size = 15, .align = Align::kCentre}, panel.width);
    }
  }
}

}  // namespace

std::vector<OverviewPart> overview_parts(const Run& run) {
  constexpr double kBodyShare = 0.94;
  constexpr double kTargetShare = 0.6;
  constexpr double kWorthACloseView = 0.6;  // of the body's scale
  const auto count = static_cast<int>(columns_of(run).size());
  const PixelBox room = {30, 76, 1000, picture_height(count) - 170};
  const Points& body = run.mesh.vertices();
  const Vector3 direction = facing(run.array, run.mesh.centroids().rowwise().mean());
  const auto part = [&](const PixelBox& of, int above, const Points& points, double share) {
    const PanelGrid grid = fitted_grid(of, count, above, seen_size(direction, points));
    return OverviewPart{grid, fitted_view(grid.panel(0), direction, points, share)};
  };
  std::vector<OverviewPart> best = {part(room, kHeadings, body, kBodyShare)};
  const Points target = run.target ? target_corners(run.mesh, *run.target) : body;
  if (fitted_view(room, direction, target, kTargetShare).scale <
      kWorthACloseView * fitted_view(room, direction, body, kBodyShare).scale) {
    double least = HUGE_VAL;
    for (const int beside : {1, 2}) {
      const PanelGrid halves = filled_grid(room, 2, beside, 0);
      const OverviewPart whole = part(halves.panel(0), kHeadings, body, kBodyShare);
      const OverviewPart close = part(halves.panel(1), beside == 2 ? kHeadings : kName, target, kTargetShare);
      if (whole.view.scale * close.view.scale < least) {
        least = whole.view.scale * close.view.scale;
        best = {whole, close};
      }
    }
  }
  return best;
}

std::string overview_picture(const Run& run) {
  const char* const quantity = shows_radiation(run) ? "P" : "|p|";
  const std::vector<OverviewColumn> columns = columns_of(run);
  std::vector<Eigen::VectorXd> reached;
  for (std::size_t i = run.target ? 1 : 0; i < columns.size(); ++i) {
    reached.push_back(columns[i].values);
  }
  ColourBar bar = skin_bar(fmt::format("{} [{}]", quantity, shows_radiation(run) ? "Pa" : "kPa"),
                           run.target ? columns[0].values.maxCoeff() : 0.0, reached);
  Canvas canvas(kPictureWidth, picture_height(static_cast<int>(columns.size())));
  describe(canvas, run.provenance);
  for (const OverviewPart& part : overview_parts(run)) {
    const SkinLook look(part.view, run.mesh, run.target);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const PixelBox panel = part.grid.panel(static_cast<int>(i));
      if (run.target && i == 0) {
        look.draw_wanted(canvas, *run.target, columns[i].values, bar.top, panel);
      } else {
        look.draw(canvas, columns[i].values, bar.top, panel);
      }
      draw_headings(canvas, panel, part.grid.above, columns[i]);
    }
    draw_scale_bar(canvas, part.view.panel, part.view.scale);
  }
  bar.box.height = canvas.height() - 260;
  draw_colour_bar(canvas, bar);
  std::string foot = "Seen from the array's side.";
  foot += bar.bottom < 0 ? " Below 0: suction." : "";
  if (run.target) {
    foot += fmt::format(
        " Green: the border of the target. Error of {} over the whole skin; width at half of the maximum.", quantity);
  }
  draw_texts(canvas, {.title = picture_title(run.name, run.notes),
                      .subtitle = shows_radiation(run) ? "radiation pressure P on the skin" : "|p| on the skin",
                      .foot = foot});
  return canvas.file();
}

}  // namespace touchfield
