#include "sim/pictures/figures.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <functional>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"
#include "sim/run/run_data.h"

namespace touchfield {

namespace {

constexpr PixelBox kPanel = {30, 120, 1140, 680};
constexpr double kShare = 0.96;
constexpr double kElevation = 25.0 * std::numbers::pi / 180.0;  // of the eye above the array's plane
constexpr double kAzimuth = 25.0 * std::numbers::pi / 180.0;    // to the right of straight in front
constexpr Colour kTransducer = {128, 138, 152};
constexpr Colour kSkin = {232, 200, 178};

double least_distance(const Points& positions) {
  double least = HUGE_VAL;
  for (Eigen::Index n = 1; n < positions.cols(); ++n) {
    least = std::min(least, (positions.leftCols(n).colwise() - positions.col(n)).colwise().squaredNorm().minCoeff());
  }
  return std::sqrt(least);
}

TriangleMesh joined_meshes(const TriangleMesh& a, const TriangleMesh& b) {
  Points vertices(3, a.vertex_count() + b.vertex_count());
  vertices << a.vertices(), b.vertices();
  Triangles triangles(3, a.face_count() + b.face_count());
  triangles << a.triangles(), (b.triangles().array() + static_cast<int>(a.vertex_count())).matrix();
  return {vertices, triangles};
}

/// From the front and above, so that the transducers' faces are seen; z up as far as it goes.
SkinView side_view(const Vector3& facing, const Points& points) {
  const Vector3 vertical = facing.z() < 0 ? Vector3(-facing) : facing;
  const Vector3 back = (std::abs(vertical.y()) < 0.99 ? Vector3::UnitY() : Vector3::UnitX());
  const Vector3 level = (back - back.dot(vertical) * vertical).normalized();
  const Vector3 right = level.cross(vertical);
  const Vector3 direction =
      std::cos(kElevation) * (std::cos(kAzimuth) * level - std::sin(kAzimuth) * right) - std::sin(kElevation) * facing;
  return fitted_view(kPanel, direction, vertical, points, kShare);
}

/// Whether a box is a disc or a mask, or goes on in another as a piece of a line does.
bool goes_on(const std::vector<TargetBox>& boxes, const TargetBox& box) {
  const Vector3 to_end = 0.5 * box.size.y() * box.rotation.col(1);
  return box.shape != TargetShape::kBox || std::ranges::any_of(boxes, [&](const TargetBox& other) {
           return &other != &box && (holds(other, box.centre + to_end) || holds(other, box.centre - to_end));
         });
}

/// The edges of boxes; of discs, lines, masks and single faces the outline on the skin.
void draw_target(Canvas& canvas, const Run& run, const SkinView& view) {
  const auto draw = [&](const Lines& lines) {
    for (Eigen::Index e = 0; e < lines.ends.cols(); ++e) {
      canvas.path({view.pixel(lines.points.col(lines.ends(0, e))), view.pixel(lines.points.col(lines.ends(1, e)))},
                  kTargetColour, 1.5);
    }
  };
  const std::vector<TargetBox>& all = run.target->boxes;
  std::vector<TargetBox> single;
  std::ranges::copy_if(all, std::back_inserter(single), [&](const TargetBox& box) { return !goes_on(all, box); });
  draw(box_edges(single));
  if (all.empty() || single.size() < all.size()) {
    draw(target_outline(run.mesh, *run.target));
  }
}

/// The directions x, y and z in the lower right corner.
void draw_directions(Canvas& canvas, const SkinView& view) {
  constexpr double kLength = 44.0;  // [pixels]
  const Eigen::Vector2d origin(kPanel.x + kPanel.width - 60.0, kPanel.y + 50.0);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector2d along(view.right()[axis], view.up[axis]);
    canvas.path({origin, origin + kLength * along}, kInk, 2.0);
    const Eigen::Vector2d label = origin + kLength * along + 12.0 * along.normalized();
    if (along.norm() > 0.1) {
      canvas.text(label.x(), label.y(), std::string(1, "xyz"[axis]), {.size = 15, .align = Align::kCentre});
    }
  }
}

}  // namespace

TriangleMesh transducer_discs(const TransducerArray& array) {
  constexpr double kMostRadius = 5e-3;  // [m]
  constexpr double kOfDistance = 0.45;
  constexpr int kCorners = 16;
  const double spacing = least_distance(array.positions);
  const double radius = spacing > 0 ? std::min(kMostRadius, kOfDistance * spacing) : kMostRadius;
  Points vertices(3, kCorners * array.size());
  Triangles triangles(3, (kCorners - 2) * array.size());
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    const Vector3 axis = array.axes.col(n);
    const Vector3 first = axis.unitOrthogonal();
    const Vector3 second = axis.cross(first);
    for (int corner = 0; corner < kCorners; ++corner) {
      const double angle = 2.0 * std::numbers::pi * corner / kCorners;
      vertices.col(kCorners * n + corner) =
          array.positions.col(n) + radius * (std::cos(angle) * first + std::sin(angle) * second);
    }
    for (int face = 0; face < kCorners - 2; ++face) {
      const auto centre = static_cast<int>(kCorners * n);
      triangles.col((kCorners - 2) * n + face) << centre, centre + face + 1, centre + face + 2;
    }
  }
  return {vertices, triangles};
}

namespace {

/// A picture of the array's transducers and the skin from the side and somewhat above the array, in parallel
/// projection, the target's outline in red.
///
/// run   its array has transducers and is no plane wave
std::string setup_picture(const Run& run, PictureFormat format) {
  const TriangleMesh mesh = joined_meshes(run.mesh, transducer_discs(run.array));
  std::vector<Colour> colours(static_cast<std::size_t>(mesh.face_count()), kTransducer);
  std::fill_n(colours.begin(), run.mesh.face_count(), kSkin);
  const Vector3 middle = run.mesh.centroids().rowwise().mean();
  const SkinSight sight(side_view(facing(run.array, middle), mesh.vertices()), mesh);

  Canvas canvas(kPictureWidth, kPictureHeight, format);
  describe(canvas, run.provenance);
  draw_sight(canvas, sight, colours, sight.view().panel);
  if (run.target) {
    draw_target(canvas, run, sight.view());
  }
  draw_scale_bar(canvas, kPanel, sight.view().scale);
  draw_directions(canvas, sight.view());
  draw_title(canvas, picture_title(run.name, run.notes), "array and skin");
  draw_caption(canvas, fmt::format("{} transducers, {} faces", run.array.size(), run.mesh.face_count()),
               fmt::format("Parallel projection.{}", run.target ? " Green: the target, through the skin." : ""));
  return canvas.file();
}

/// The run with the evaluation's skin and pressures for its own, where there are some: what its metrics are of.
Run as_evaluated(const Run& run) {
  Run evaluated = run;
  const auto is_evaluated = [](const MethodResult& result) {
    return result.evaluation_pressure.size() != 0 && result.pressure.size() != 0;
  };
  if (run.evaluation_model && std::ranges::all_of(run.methods, is_evaluated)) {
    evaluated.mesh = run.evaluation_model->mesh;
    evaluated.target = run.evaluation_model->target;
    for (MethodResult& result : evaluated.methods) {
      result.pressure = result.evaluation_pressure;
    }
  } else if (run.evaluation_model) {
    for (MethodResult& result : evaluated.methods) {
      result.radiation.resize(0);  // it is of another skin
    }
  }
  return evaluated;
}

/// The end of the colours of a plane.
double field_top(const FieldResult& field, const Eigen::VectorXcd& pressure) {
  std::vector<double> outside;
  for (Eigen::Index i = 0; i < pressure.size(); ++i) {
    if (field.inside[static_cast<std::size_t>(i)] == 0) {
      outside.push_back(std::abs(pressure(i)));
    }
  }
  return round_above(quantile(std::move(outside), kTopShare));
}

/// The words of the values that were computed.
std::string words_of(const std::vector<std::pair<double, std::string>>& figures) {
  std::string text;
  for (const auto& [value, words] : figures) {
    if (!std::isnan(value)) {
      text += (text.empty() ? "" : "     ") + words;
    }
  }
  return text;
}

std::string width_words(double width, double wanted) {
  return fmt::format("width {:.1f} mm", width) + (std::isnan(wanted) ? "" : fmt::format(" (wanted {:.1f})", wanted));
}

std::string metrics_text(const Metrics& m) {
  return words_of({{m.relative_error, fmt::format("relative error {:.1f} %", 100.0 * m.relative_error)},
                   {m.width_mm, width_words(m.width_mm, m.width_wanted_mm)},
                   {m.leakage, fmt::format("leakage {:.0f} %", 100.0 * m.leakage)},
                   {m.peak_pa, fmt::format("peak {:.3g} kPa", 1e-3 * m.peak_pa)}});
}

std::string radiation_text(const Metrics& m) {
  return words_of(
      {{m.relative_error_radiation, fmt::format("relative error {:.1f} %", 100.0 * m.relative_error_radiation)},
       {m.width_radiation_mm, width_words(m.width_radiation_mm, m.width_wanted_mm)},
       {m.force_target_n, fmt::format("force on the target {:.3g} mN", 1e3 * m.force_target_n)},
       {m.abs_force_elsewhere_n, fmt::format("outside {:.3g} mN", 1e3 * m.abs_force_elsewhere_n)}});
}

/// A file's name without its ending, and what draws it.
struct Picture {
  std::string name;
  std::function<std::string()> draw;
};

/// The colours of all methods' radiation pressures.
SkinScale radiation_scale(const Run& run) {
  double most = 0.0;
  double least = 0.0;
  for (const MethodResult& result : run.methods) {
    most = std::max(most, quantile({result.radiation.begin(), result.radiation.end()}, kTopShare));
    least = std::min(least, result.radiation.size() == 0 ? 0.0 : result.radiation.minCoeff());
  }
  const double wanted = run.target ? run.radiation_per_square * std::pow(run.target->amplitudes.maxCoeff(), 2) : 0.0;
  const double top = skin_top(wanted, most);
  return {
      .top = top, .bottom = least < 0.0 ? -std::min(round_above(-least), top) : 0.0, .label = "P [Pa]", .unit = 1.0};
}

void add_skin(const Run& run, const SkinPictures& skin, PictureFormat format, std::vector<Picture>& pictures) {
  std::vector<const Eigen::VectorXcd*> pressures;
  std::ranges::transform(run.methods, std::back_inserter(pressures),
                         [](const auto& result) { return &result.pressure; });
  const double top = skin_top(run.target ? run.target->amplitudes.maxCoeff() : 0.0, pressures);
  pictures.push_back({"overview", [&run, top, format] { return overview_picture(run, top, format); }});
  const auto add = [&](const std::string& name, const Eigen::VectorXd& values, const SkinScale& scale,
                       const std::string& subtitle, const std::string& caption, const char* colours) {
    const SkinText text = {
        .title = picture_title(run.name, run.notes), .subtitle = subtitle, .caption = caption, .colours = colours};
    pictures.push_back({name, [&skin, values, scale, text] { return skin.picture(values, scale, text); }});
  };
  constexpr const char* kPressures = "All pictures of this run's skin share these colours.";
  if (run.target) {
    const SkinText text = {.title = picture_title(run.name, run.notes),
                           .subtitle = "wanted pressure",
                           .caption = fmt::format("{:.4g} mm2 on {} of {} faces, up to {:.4g} kPa",
                                                  1e6 * run.target->areas(run.mesh.areas()).sum(), run.target->size(),
                                                  run.mesh.face_count(), 1e-3 * run.target->amplitudes.maxCoeff()),
                           .colours = kPressures};
    pictures.push_back({"target", [&skin, top, text] { return skin.wanted_picture(top, text); }});
  }
  for (const MethodResult& result : run.methods) {
    if (result.pressure.size() != 0) {
      add("pressure_" + result.name, result.pressure.cwiseAbs(), {.top = top}, "method " + result.name,
          metrics_text(result.metrics), kPressures);
    }
  }
  const SkinScale scale = radiation_scale(run);
  for (const MethodResult& result : run.methods) {
    if (result.radiation.size() != 0) {
      add("radiation_" + result.name, result.radiation, scale, "radiation pressure of method " + result.name,
          radiation_text(result.metrics),
          "All pictures of the radiation pressure share these colours. Below 0: suction.");
    }
  }
}

void add_planes(const Run& run, PictureFormat format, std::vector<Picture>& pictures) {
  for (const FieldResult& field : run.fields) {
    if (!is_plane(field.grid)) {
      continue;
    }
    double loudest = 0.0;
    for (const auto& [method, pressure] : field.pressure) {
      loudest = std::max(loudest, field_top(field, pressure));
    }
    for (const auto& [method, pressure] : field.pressure) {
      pictures.push_back(
          {fmt::format("field_{}_{}", field.grid.name, method),
           [&run, &field, &pressure = pressure, loudest, format,
            subtitle = fmt::format("field {}, method {}", field.grid.name, method)] {
             return field_picture(run, field, pressure, {field_top(field, pressure), loudest}, subtitle, format);
           }});
    }
  }
}

/// skin   is made where there is one to draw; outlives the pictures
std::vector<Picture> pictures_of(const Run& run, PictureFormat format, std::optional<SkinPictures>& skin) {
  std::vector<Picture> pictures;
  if (run.target || std::ranges::any_of(run.methods, [](const auto& result) { return result.pressure.size() != 0; })) {
    if (run.array.kind == TransducerArray::Kind::kTransducers) {
      pictures.push_back({"setup", [&run, format] { return setup_picture(run, format); }});
    }
    skin.emplace(run, format);
    add_skin(run, *skin, format, pictures);
  }
  add_planes(run, format, pictures);
  return pictures;
}

std::vector<std::string> drawn_at_once(const std::vector<Picture>& pictures) {
  std::vector<std::string> files(pictures.size());
  std::exception_ptr failure;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    try {
      files[i] = pictures[i].draw();
    } catch (...) {
#pragma omp critical
      failure = std::current_exception();
    }
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
  return files;
}

}  // namespace

std::string draw_figure(const std::string& name, const Run& run, PictureFormat format) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  std::optional<SkinPictures> skin;
  const std::vector<Picture> pictures = pictures_of(evaluated, format, skin);
  const auto picture = std::ranges::find(pictures, name, &Picture::name);
  if (picture == pictures.end()) {
    std::vector<std::string> names;
    std::ranges::transform(pictures, std::back_inserter(names), &Picture::name);
    throw InputError(fmt::format("run {}: no picture is called '{}'; the pictures are {}", run.name, name,
                                 names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  return picture->draw();
}

std::vector<std::string> draw_figures(const std::string& directory, const Run& run, PictureFormat format) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  std::optional<SkinPictures> skin;
  const std::vector<Picture> pictures = pictures_of(evaluated, format, skin);
  const std::vector<std::string> drawn = drawn_at_once(pictures);
  std::vector<std::string> files;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    files.push_back(
        (std::filesystem::path(directory) / fmt::format("{}.{}", pictures[i].name, to_string(format))).string());
    write_atomically(files.back(), {drawn[i]});
  }
  return files;
}

}  // namespace touchfield
