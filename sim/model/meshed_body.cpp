#include "sim/model/meshed_body.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/field/target.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/resurface.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

bool same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
  constexpr double kSamePlace = 1e-9;  // [m]
  return a.vertex_count() == b.vertex_count() && a.face_count() == b.face_count() && a.triangles() == b.triangles() &&
         (a.vertices() - b.vertices()).cwiseAbs().maxCoeff() <= kSamePlace;
}

const TriangleMesh* KeptBodies::like(const TriangleMesh& mesh) const {
  const auto found =
      std::ranges::find_if(entries_, [&](const auto& entry) { return same_mesh(entry.second.meshed.body.mesh, mesh); });
  return found != entries_.end() ? &found->second.meshed.body.mesh : nullptr;
}

const MeshedBody& KeptBodies::get(const std::string& role, const std::string& key,
                                  const std::function<MeshedBody()>& make) {
  const auto found = entries_.find(role);
  if (found != entries_.end() && found->second.key == key) {
    return found->second.meshed;
  }
  MeshedBody meshed = make();  // first, so that a body that cannot be meshed leaves what was kept
  return entries_.insert_or_assign(role, Entry{key, std::move(meshed)}).first->second.meshed;
}

Vector3 KeptBodies::landmark(const std::string& key, const std::function<Vector3()>& find) {
  const auto found = landmarks_.find(key);
  return found != landmarks_.end() ? found->second : landmarks_.emplace(key, find()).first->second;
}

namespace {

constexpr double kLostLandmark = 0.5 * kMillimetre;  // farther from what is kept of a body: the landmark went with it

std::string shape_key(const BodySpec& body) {
  return called(body) + (std::get<MeshShape>(body.shape).series ? ".meshes" : ".mesh");
}

std::optional<UnitDoubt> doubt_of(const BodySpec& body, double size) {
  const auto& shape = std::get<MeshShape>(body.shape);
  auto doubt = unit_doubt(size, shape.unit_given ? std::optional(shape.unit_name) : std::nullopt);
  if (doubt && doubt->refuse && shape.unit_given) {
    const UnitGuess better = guess_unit(size);
    doubt->text = fmt::format("{}.file: the mesh is {} across. If the file is in {}, set unit: {}{}", shape_key(body),
                              length_text(size * shape.unit), unit_in_words(better.unit), better.unit.name,
                              better.certainty == UnitCertainty::kSure ? "" : fmt::format(" ({})", better.reason));
  } else if (doubt) {
    const std::string remedy = shape.unit_given ? "" : fmt::format(". Set {}.unit", shape_key(body));
    doubt->text = fmt::format("{}: {}{}", shape.file, doubt->text, remedy);
  }
  return doubt;
}

/// What the file says; errors say where the scene names it too.
FileSurface surface_of(const MeshShape& shape) {
  try {
    return read_surface(shape.file);
  } catch (const InputError& error) {
    throw InputError(shape.named.empty() ? error.what() : fmt::format("{}: {}", shape.named, error.what()));
  }
}

/// Adds a line for each of what was done to a file.
void add_notes(const std::vector<std::string>& steps, const std::string& file, std::vector<std::string>& notes) {
  for (const std::string& step : steps) {
    notes.push_back(fmt::format("{}: {}", file, step));
  }
}

/// A point in a file's unit: "(22, 156.25, -9) mm".
std::string file_place(const Vector3& point, const MeshShape& shape) {
  constexpr double kParts = 1e6;
  const Vector3 x = (kParts / shape.unit * point).array().round() / kParts + 0.0;  // no -0, no 3e-17
  return fmt::format("({:.5g}, {:.5g}, {:.5g}) {}", x.x(), x.y(), x.z(), shape.unit_name);
}

/// What a landmark would have to be multiplied by to lie on the skin, said as a remedy; empty if no unit puts it there.
std::string other_unit(const TriangleMesh& skin, const Vector3& point, const MeshShape& shape) {
  for (const LengthUnit& unit : kFileUnits) {
    const Vector3 meant = unit.metres / shape.unit * point;
    const Vector3 nearest = position(skin, nearest_landmark(skin, "", meant));
    if (unit.metres != shape.unit && (nearest - meant).norm() < kNotedLandmarkOff) {
      return fmt::format(". If it is in {}, write {}", unit_in_words(unit), file_place(meant, shape));
    }
  }
  return "";
}

/// A landmark goes to the nearest point of the new skin, unless the part of the file's surface that it names has gone.
MeshedBody resurfaced_body(const BodySpec& spec) {
  const auto& shape = std::get<MeshShape>(spec.shape);
  const double edge = *shape.resurface;
  const FileSurface surface = surface_of(shape);
  Resurfaced skin = resurfaced(surface, shape.unit, edge, shape.file, "mesh.resurface_mm");
  given_landmarks(spec, skin.original);
  MeshedBody made{{std::move(skin.mesh), {}}, {}, {}};
  for (const auto& [name, point] : shape.landmarks) {
    made.body.landmarks.push_back(nearest_landmark(made.body.mesh, name, point));
    const Vector3 named = position(skin.original, nearest_landmark(skin.original, name, point));
    const Landmark nearest = nearest_landmark(made.body.mesh, name, named);
    const double distance = (position(made.body.mesh, nearest) - named).norm();
    if (distance > edge) {
      throw InputError(
          fmt::format("{}: landmark '{}' is on the file's surface at {}, {:.2f} mm from the resurfaced skin, inside it "
                      "or lost; it must be within mesh.resurface_mm = {:.4g} mm",
                      shape.file, name, place_text(named, 2), distance / kMillimetre, edge / kMillimetre));
    }
  }
  add_notes(surface.notes, shape.file, made.notes);
  add_notes(skin.steps, shape.file, made.notes);
  return made;
}

/// A series is not mended: its meshes must keep the same triangles.
ClosedMesh unmended(const MeshShape& shape) {
  ClosedMesh made{read_mesh(shape.file, shape.unit), {}};
  require_closed_surface(made.mesh, shape.file);
  return made;
}

/// The faces of the file, which are closed.
MeshedBody closed_body(const BodySpec& spec) {
  const auto& shape = std::get<MeshShape>(spec.shape);
  const FileSurface surface = surface_of(shape);
  ClosedMesh mended = shape.series ? unmended(shape) : closed_mesh(surface, shape.unit, shape.file);
  MeshedBody made{{std::move(mended.mesh), {}}, {}, {}};
  given_landmarks(spec, made.body.mesh);
  for (const auto& [name, point] : shape.landmarks) {
    made.body.landmarks.push_back(nearest_landmark(made.body.mesh, name, point));
  }
  add_notes(surface.notes, shape.file, made.notes);
  add_notes(mended.steps, shape.file, made.notes);
  return made;
}

/// The faces of a file that have an area, and their numbers there.
std::pair<TriangleMesh, std::vector<std::size_t>> faces_with_area(const FileSurface& surface, double unit) {
  Points points(3, static_cast<Eigen::Index>(surface.points.size()));
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    points.col(v) = unit * surface.points[static_cast<std::size_t>(v)];
  }
  std::vector<std::size_t> kept;
  Triangles triangles(3, static_cast<Eigen::Index>(surface.triangles.size()));
  for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
    const auto& [a, b, c] = surface.triangles[f];
    const Eigen::Vector3i face(static_cast<int>(a), static_cast<int>(b), static_cast<int>(c));
    if (!is_flat(points, face)) {
      triangles.col(static_cast<Eigen::Index>(kept.size())) = face;
      kept.push_back(f);
    }
  }
  return {{std::move(points), triangles.leftCols(static_cast<Eigen::Index>(kept.size()))}, std::move(kept)};
}

}  // namespace

HandOptions hand_options(const HandShape& shape, double edge) {
  return {shape.pose, shape.breadth, shape.length, shape.side, edge, shape.joints, shape.forearm};
}

std::string called(const BodySpec& spec) { return spec.name.empty() ? "body" : fmt::format("bodies: {}", spec.name); }

void check_unit(const BodySpec& body, std::vector<std::string>& warnings) {
  constexpr double kLongestEdge = 1.0 / 3.0;  // of the body's size
  const auto& shape = std::get<MeshShape>(body.shape);
  const double size = surface_size(surface_of(shape));
  const auto doubt = doubt_of(body, size);
  if (doubt && doubt->refuse) {
    throw InputError(doubt->text);
  }
  require_body_size(size * shape.unit, shape.file);
  if (body.edge && body.edge->finest() > kLongestEdge * size * shape.unit) {
    throw InputError(fmt::format(
        "{}.edge_mm: {:.4g} mm is too long for a mesh of {}, it must be at most a third of that{}", called(body),
        body.edge->finest() / kMillimetre, length_text(size * shape.unit), doubt ? "; " + doubt->text : ""));
  }
  if (doubt) {
    warnings.push_back("mesh_unit: " + doubt->text);
  }
}

std::vector<GivenLandmark> given_landmarks(const BodySpec& body, const TriangleMesh& skin) {
  const auto& shape = std::get<MeshShape>(body.shape);
  std::vector<GivenLandmark> landmarks;
  for (const auto& [name, point] : shape.landmarks) {
    const Vector3 nearest = position(skin, nearest_landmark(skin, name, point));
    const double off = (nearest - point).norm();
    std::string text = fmt::format("{}.landmarks.{}: {} is {:.3g} {} off the skin of {}; its nearest point is {}",
                                   shape_key(body), name, file_place(point, shape), off / shape.unit, shape.unit_name,
                                   shape.file, file_place(nearest, shape));
    require(!(off >= kMostLandmarkOff), "{}; it must be within {:.4g} {}{}", text, kMostLandmarkOff / shape.unit,
            shape.unit_name, other_unit(skin, point, shape));
    landmarks.push_back({name, off, std::move(text)});
  }
  return landmarks;
}

Body body_from_file(const BodySpec& spec, KeptBodies* kept, std::vector<std::string>* notes) {
  const auto& shape = std::get<MeshShape>(spec.shape);
  const auto make = [&] { return shape.resurface ? resurfaced_body(spec) : closed_body(spec); };
  MeshedBody made =
      kept != nullptr ? kept->get("file " + shape.file, shape_text(spec) + file_state(shape.file), make) : make();
  if (notes != nullptr) {
    *notes = std::move(made.notes);
  }
  return std::move(made.body);
}

MaskedPart masked_part(const BodySpec& spec, const TargetMaskSpec& mask) {
  const auto* shape = std::get_if<MeshShape>(&spec.shape);
  require(shape != nullptr,
          "target.mask_file: {} has no mesh file. A mask has one number per face of such a file; write the body to one "
          "(a built-in hand: "
          "touchfield hand -o hand.stl) and name it in body.mesh.file",
          called(spec));
  require(!shape->series, "target.mask_file: {} is a series of meshes; a mask is for one, body.mesh", called(spec));
  const FileSurface surface = surface_of(*shape);
  require(
      mask.levels.size() == surface.triangles.size(),
      "target.mask_file: {} has {} levels, it must have one for each of the {} faces of {} (a polygon counts as the "
      "triangles that it is cut into)",
      mask.file, mask.levels.size(), surface.triangles.size(), shape->file);
  const auto [mesh, kept] = faces_with_area(surface, shape->unit);
  std::vector<double> levels;
  std::ranges::transform(kept, std::back_inserter(levels), [&](std::size_t face) { return mask.levels[face]; });
  require(std::ranges::any_of(levels, [](double level) { return level > 0; }),
          "target.mask_file: {} marks only faces of {} that have no area", mask.file, shape->file);
  return {masked_box(mesh, levels, "target.mask_file"), masked_places(mesh, levels)};
}

Body plain_body(const BodySpec& spec, double edge, KeptBodies* kept) {
  return std::visit(
      [&](const auto& shape) -> Body {
        using Shape = std::decay_t<decltype(shape)>;
        if constexpr (std::is_same_v<Shape, HandShape>) {
          return hand(hand_options(shape, edge));
        } else if constexpr (std::is_same_v<Shape, SphereShape>) {
          return sphere(shape.radius, edge);
        } else if constexpr (std::is_same_v<Shape, CapsuleShape>) {
          return capsule(shape.radius, shape.length, edge);
        } else if constexpr (std::is_same_v<Shape, BoxShape>) {
          return box(shape.size, edge);
        } else {
          return body_from_file(spec, kept);
        }
      },
      spec.shape);
}

std::vector<Landmark> carried_over(const Body& from, const TriangleMesh& to) {
  std::vector<Landmark> landmarks;
  for (const Landmark& landmark : from.landmarks) {
    const Vector3 at = position(from.mesh, landmark);
    Landmark moved = nearest_landmark(to, landmark.name, at);
    if ((position(to, moved) - at).norm() <= kLostLandmark + 0.3 * to.mean_edge()) {
      landmarks.push_back(std::move(moved));
    }
  }
  return landmarks;
}

std::string file_state(const std::string& file) {
  const auto written = std::filesystem::last_write_time(file);
  return fmt::format(" {} {}", std::filesystem::file_size(file), written.time_since_epoch().count());
}

Body meshed(const BodySpec& spec, const EdgeSpec* edge, const EdgeSizing* sizing, KeptBodies* kept) {
  if (edge == nullptr) {
    return plain_body(spec, 0.0, kept);  // the faces of its file
  }
  const bool from_file = std::holds_alternative<MeshShape>(spec.shape);
  if (!edge->graded() && !from_file) {
    return plain_body(spec, edge->far, kept);
  }
  if (const auto* shape = std::get_if<HandShape>(&spec.shape)) {
    return hand(hand_options(*shape, edge->finest()), *sizing);
  }
  const Body base = plain_body(spec, edge->finest(), kept);
  Body body{remeshed_surface(base.mesh, *sizing), {}};
  body.landmarks = carried_over(base, body.mesh);
  return body;
}

void require_body(const BodySpec& body) {
  std::vector<std::string> warnings;  // which a run repeats
  check_unit(body, warnings);
  body_from_file(body, nullptr);
}

}  // namespace touchfield
