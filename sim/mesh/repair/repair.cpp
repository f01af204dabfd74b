#include "sim/mesh/repair/repair.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "sim/core/counted.h"
#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/repair/repair_steps.h"
#include "sim/mesh/repair/surface_report.h"
#include "sim/mesh/repair/weld.h"
#include "sim/mesh/subset.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

double diagonal(const Points& points) {
  return points.cols() == 0 ? 0.0 : (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
}

/// Lengths of the edges of each face, 3 x M.
Points edge_lengths(const RawSurface& surface) {
  Points lengths(3, surface.triangles.cols());
  for (Index f = 0; f < lengths.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int from = surface.triangles(c, f);
      lengths(c, f) = (surface.points.col(surface.triangles((c + 1) % 3, f)) - surface.points.col(from)).norm();
    }
  }
  return lengths;
}

double median(Points lengths) {
  double* const middle = lengths.data() + lengths.size() / 2;
  std::nth_element(lengths.data(), middle, lengths.data() + lengths.size());
  return lengths.size() == 0 ? 0.0 : *middle;
}

void require_options(const RepairOptions& options) {
  for (const auto& [value, name] : {std::pair(options.weld, "weld"), std::pair(options.hole, "hole")}) {
    if (value && !(*value >= 0 && std::isfinite(*value))) {
      throw InputError(fmt::format("repair: {} = {} m must be >= 0 and finite", name, *value));
    }
  }
  if (!(options.stray >= 0 && options.stray <= 1)) {
    throw InputError(fmt::format("repair: stray = {} must be 0 to 1", options.stray));
  }
}

/// The shortest edge of the faces that are no needles: what is finer is no edge that the surface means to have.
double shortest_genuine_edge(const Points& lengths) {
  constexpr double kNeedle = 1e-3;  // shortest edge over longest
  double shortest = std::numeric_limits<double>::infinity();
  for (const auto& face : lengths.colwise()) {
    if (face.minCoeff() >= kNeedle * face.maxCoeff()) {
      shortest = std::min(shortest, face.minCoeff());
    }
  }
  return shortest;
}

double weld_tolerance(const RawSurface& exact) {
  constexpr double kOfDiagonal = 1e-5;
  constexpr double kOfMedian = 0.01;
  constexpr double kOfShortest = 0.1;
  const Points lengths = edge_lengths(exact);
  return std::min({kOfDiagonal * diagonal(exact.points), kOfMedian * median(lengths),
                   kOfShortest * shortest_genuine_edge(lengths)});
}

std::string collapsed_text(Index faces) {
  return fmt::format("dropped {} with two corners in one point", counted(faces, "face", "faces"));
}

/// The first step; says what it left out.
RawSurface welded_surface(const FileSurface& surface, double unit, double tolerance, std::vector<bool>& copied,
                          StepLog& log) {
  WeldedSurface merged = welded(surface, unit, tolerance);
  if (merged.unreferenced > 0) {
    log.push_back(fmt::format("dropped {} that no face names", counted(merged.unreferenced, "point", "points")));
  }
  if (merged.welded > 0) {
    log.push_back(
        fmt::format("welded {} to others {}", counted(merged.welded, "point", "points"),
                    tolerance > 0 ? fmt::format("within {:.3g} mm", tolerance / kMillimetre) : "in the same place"));
  }
  if (merged.collapsed_faces > 0) {
    log.push_back(collapsed_text(merged.collapsed_faces));
  }
  Triangles triangles = without_duplicates(merged.triangles, copied);
  if (const Index duplicates = merged.triangles.cols() - triangles.cols(); duplicates > 0) {
    log.push_back(fmt::format("dropped {} with the corners of an earlier one", counted(duplicates, "face", "faces")));
  }
  return {std::move(merged.points), std::move(triangles)};
}

[[noreturn]] void give_up(const std::string& name, const std::vector<std::string>& faults) {
  throw InputError(fmt::format("{}: the mesh cannot be repaired: {}", name, fmt::join(faults, "; ")));
}

/// What no later step can mend.
void require_orientable(const RawSurface& surface, const std::string& name) {
  if (surface.triangles.cols() == 0) {
    give_up(name, {"no face is left"});
  }
  const MeshReport report = inspect(surface.points, surface.triangles);
  std::vector<std::string> faults = report.faults;
  if (report.misoriented_edges > 0) {
    faults.insert(faults.begin(), "it is not orientable, as a Moebius strip is not");
  }
  if (report.misoriented_edges > 0 || report.nonmanifold_edges > 0) {
    give_up(name, faults);
  }
}

}  // namespace

Repaired repaired(const FileSurface& file, double unit, const RepairOptions& options, const std::string& name) {
  require_options(options);
  StepLog log;
  std::vector<bool> copied;
  RawSurface surface = welded_surface(file, unit, options.weld.value_or(0.0), copied, log);
  if (inspect_skin(surface.points, surface.triangles).faults.empty()) {
    drop_stray_pieces(surface, options.stray, log);
    drop_unused_points(surface.points, surface.triangles);
    return {TriangleMesh(std::move(surface.points), std::move(surface.triangles)), std::move(log)};
  }
  if (!options.weld) {
    log.clear();
    surface = welded_surface(file, unit, weld_tolerance(surface), copied, log);
  }
  const double hole_limit = options.hole.value_or(0.1 * diagonal(surface.points));

  drop_flaps(surface, copied, options.stray, log);
  drop_stray_pieces(surface, options.stray, log);
  make_consistent(surface, log);
  require_orientable(surface, name);
  std::vector<std::string> faults = fill_small_holes(surface, hole_limit, log, options.unwanted);
  if (faults.empty()) {
    split_pinched_vertices(surface, log);
    remove_slivers(surface, log);
    turn_outwards(surface, log);
  }
  drop_unused_points(surface.points, surface.triangles);
  SkinReport report = inspect_skin(surface.points, surface.triangles);
  if (report.crossings > 0 && report.faults.size() == 1) {
    cut_out_crossings(surface, options.stray, log);
    report = inspect_skin(surface.points, surface.triangles);
  }
  faults.insert(faults.end(), report.faults.begin(), report.faults.end());
  if (!faults.empty()) {
    give_up(name, faults);
  }
  return {TriangleMesh(std::move(surface.points), std::move(surface.triangles)), std::move(log)};
}

Repaired closed_mesh(const FileSurface& file, double unit, const std::string& name) {
  StepLog log;
  WeldedSurface merged = welded(file, unit, 0.0);
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
  return {TriangleMesh(std::move(surface.points), std::move(surface.triangles)), std::move(log)};
}

}  // namespace touchfield
