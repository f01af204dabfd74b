#include "sim/mesh/repair/repair.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sim/core/counted.h"
#include "sim/core/errors.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/io/weld.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/repair/repair_steps.h"
#include "sim/mesh/repair/resurface.h"
#include "sim/mesh/repair/surface_report.h"
#include "sim/mesh/subset.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

std::string collapsed_text(Index faces) {
  return fmt::format("dropped {} with two corners in one point", counted(faces, "face", "faces"));
}

/// The first step; says what it left out.
RawSurface merged_surface(const FileSurface& file, double unit, StepLog& log) {
  WeldedSurface merged = welded(file, unit);
  if (merged.unreferenced > 0) {
    log.push_back(fmt::format("dropped {} that no face names", counted(merged.unreferenced, "point", "points")));
  }
  if (merged.welded > 0) {
    log.push_back(fmt::format("welded {} to others in the same place", counted(merged.welded, "point", "points")));
  }
  if (merged.collapsed_faces > 0) {
    log.push_back(collapsed_text(merged.collapsed_faces));
  }
  Triangles triangles = without_duplicates(merged.triangles);
  if (const Index duplicates = merged.triangles.cols() - triangles.cols(); duplicates > 0) {
    log.push_back(fmt::format("dropped {} with the corners of an earlier one", counted(duplicates, "face", "faces")));
  }
  return {std::move(merged.points), std::move(triangles)};
}

/// The steps that leave faces where they are.
RawSurface mended_surface(const FileSurface& file, double unit, StepLog& log) {
  RawSurface surface = merged_surface(file, unit, log);
  if (surface.triangles.cols() == 0) {
    return surface;
  }
  drop_stray_pieces(surface, log);
  make_consistent(surface, log);
  const MeshReport report = inspect(surface.points, surface.triangles);
  if (report.closed() && report.misoriented_edges == 0 && report.nonmanifold_vertices == 0) {
    remove_slivers(surface, log);
    turn_outwards(surface, log);
  }
  drop_unused_points(surface.points, surface.triangles);
  return surface;
}

/// A new skin of all faces of a file.
Repaired new_skin(const FileSurface& file, double unit, const RepairOptions& options, double mean_edge,
                  const std::string& name) {
  constexpr double kLeastEdge = 1.0 / 300.0;  // of the size, 0.6 mm of a hand: the grid's nodes fit
  constexpr double kMostEdge = 1.0 / 64.0;    // of the size, 3 mm of a hand
  const double size = surface_size(file) * unit;
  Resurfaced made = options.edge ? resurfaced(file, unit, *options.edge, name, "--resurface")
                                 : resurfaced(file, unit, std::clamp(mean_edge, kLeastEdge * size, kMostEdge * size),
                                              name, "--resurface, which --repair chose,");
  return {std::move(made.mesh), std::move(made.steps), made.to_skin, made.from_skin};
}

}  // namespace

Repaired repaired(const FileSurface& file, double unit, const RepairOptions& options, const std::string& name) {
  if (!options.keeps_faces) {
    return new_skin(file, unit, options, 0, name);
  }
  StepLog log;
  RawSurface surface = mended_surface(file, unit, log);
  const SkinReport report = inspect_skin(surface.points, surface.triangles);
  if (report.faults.empty()) {
    return {TriangleMesh(std::move(surface.points), std::move(surface.triangles)), std::move(log), {}, {}};
  }
  if (report.mean_edge == 0) {
    throw InputError(fmt::format("{}: {}", name, report.faults.front()));
  }
  if (report.mesh.misoriented_edges > 0) {
    throw InputError(fmt::format("{}: the mesh cannot be repaired: it is not orientable, as a Moebius strip is not: {}",
                                 name, fmt::join(report.faults, "; ")));
  }
  Repaired made = new_skin(file, unit, options, report.mean_edge, name);
  made.steps.insert(made.steps.begin(),
                    fmt::format("all faces are replaced because of these faults: {}", fmt::join(report.faults, "; ")));
  surface = {made.mesh.vertices(), made.mesh.triangles()};
  drop_stray_pieces(surface, made.steps);
  drop_unused_points(surface.points, surface.triangles);
  made.mesh = TriangleMesh(std::move(surface.points), std::move(surface.triangles));
  return made;
}

Repaired closed_mesh(const FileSurface& file, double unit, const std::string& name) {
  StepLog log;
  WeldedSurface merged = welded(file, unit);
  if (merged.collapsed_faces > 0) {
    log.push_back(collapsed_text(merged.collapsed_faces));
  }
  RawSurface surface{std::move(merged.points), std::move(merged.triangles)};
  const auto flat_faces = [&] {
    const auto columns = surface.triangles.colwise();
    return std::count_if(columns.begin(), columns.end(),
                         [&](const auto& face) { return is_flat(surface.points, face); });
  };
  std::vector<std::string> faults;
  if (surface.triangles.cols() == 0) {
    faults.emplace_back("no face has an area");
  } else {
    faults = inspect(surface.points, surface.triangles).faults;
  }
  if (faults.empty() && flat_faces() > 0) {
    remove_slivers(surface, log);
    if (const Index left = flat_faces(); left > 0) {
      faults.push_back(counted(left, "face", "faces") + " without area");
    }
  }
  if (!faults.empty()) {
    throw InputError(fmt::format(
        "{}: the mesh must be a closed surface with outward normals: {}; try touchfield mesh {} --repair -o fixed.obj",
        name, fmt::join(faults, "; "), name));
  }
  return {TriangleMesh(std::move(surface.points), std::move(surface.triangles)), std::move(log), {}, {}};
}

}  // namespace touchfield
