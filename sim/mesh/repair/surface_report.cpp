#include "sim/mesh/repair/surface_report.h"

#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/io/weld.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/subset.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

}  // namespace

SkinReport inspect_skin(const Points& points, const Triangles& triangles) {
  SkinReport report;
  Index first_flat = -1;
  Triangles solid = faces_where(triangles, [&](Index f) {
    const bool flat = is_flat(points, triangles.col(f));
    first_flat = flat && report.flat_faces++ == 0 ? f : first_flat;
    return !flat;
  });
  if (solid.cols() == 0) {
    report.faults.emplace_back("no face has an area");
    return report;
  }
  if (report.flat_faces > 0) {
    report.faults.push_back(fmt::format("{} without area, the first at {}", counted(report.flat_faces, "face", "faces"),
                                        place_text(points.col(triangles(0, first_flat)), 2)));
  }
  report.mesh = inspect(points, triangles);
  report.faults.insert(report.faults.end(), report.mesh.faults.begin(), report.mesh.faults.end());
  const TriangleMesh mesh(points, std::move(solid));
  report.mean_edge = mesh.mean_edge();
  const auto pairs = self_intersections(mesh, SkinReport::kMostCrossings);
  report.crossings = std::ssize(pairs);
  if (!pairs.empty()) {
    report.faults.push_back(self_intersections_text(mesh, pairs, SkinReport::kMostCrossings));
  }
  return report;
}

SurfaceReport inspect_surface(const FileSurface& surface, double unit) {
  const WeldedSurface merged = welded(surface, unit);
  const Triangles triangles = without_duplicates(merged.triangles);

  SurfaceReport report;
  report.points = static_cast<Index>(surface.points.size());
  report.faces = static_cast<Index>(surface.triangles.size());
  report.unreferenced_points = merged.unreferenced;
  report.repeated_points = merged.welded;
  report.collapsed_faces = merged.collapsed_faces;
  report.duplicate_faces = merged.triangles.cols() - triangles.cols();
  report.skin = inspect_skin(merged.points, triangles);

  std::vector<std::string> faults;
  if (report.collapsed_faces > 0) {
    faults.push_back(counted(report.collapsed_faces, "face has", "faces have") + " two corners in one point");
  }
  if (report.duplicate_faces > 0) {
    faults.push_back(counted(report.duplicate_faces, "face has", "faces have") + " the corners of an earlier one");
  }
  report.skin.faults.insert(report.skin.faults.begin(), faults.begin(), faults.end());
  return report;
}

}  // namespace touchfield
