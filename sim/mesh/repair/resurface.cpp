#include "sim/mesh/repair/resurface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/query/skin_patches.h"
#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/mesh/repair/inside_grid.h"
#include "sim/mesh/repair/oriented_soup.h"
#include "sim/mesh/subset.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

constexpr double kGrid = 0.5;  // spacing over edge

/// What messages name.
struct Asked {
  std::string name;
  std::string field;
  double edge;

  std::string value() const { return fmt::format("{}: {} = {:.4g} mm", name, field, edge / kMillimetre); }
};

std::string volume_text(double volume) { return fmt::format("{:.4g} cm3", 1e6 * volume); }

/// The outer pieces of the boundary of what the soup winds round that are large enough to be meshed.
TriangleMesh outer_surface(const TriangleMesh& soup, const Asked& asked, std::vector<std::string>& steps) {
  Isosurface surface = InsideGrid(soup, kGrid * asked.edge).surface();
  const Pieces pieces = find_pieces(surface.points, surface.triangles, sorted_sides(surface.triangles));
  const std::vector<bool> inner = nested(surface.points, surface.triangles, pieces);
  std::vector<bool> keep;
  double kept = 0;
  double filled = 0;
  double dropped = 0;
  for (std::size_t p = 0; p < inner.size(); ++p) {
    const double volume = pieces.list[p].volume;
    keep.push_back(!inner[p] && volume >= std::pow(asked.edge, 3));
    (inner[p] ? filled : keep[p] ? kept : dropped) += std::abs(volume);
  }
  if (kept == 0) {
    throw InputError(fmt::format(
        "{} is too long, or the surface has no volume: no part larger and thicker than it encloses its points more "
        "than half",
        asked.value()));
  }
  if (filled > 0) {
    steps.push_back(fmt::format("filled cavities of {} in all", volume_text(filled)));
  }
  if (dropped > 0) {
    steps.push_back(fmt::format("dropped pieces smaller than a cube of the edge, {} in all", volume_text(dropped)));
  }
  surface.triangles = faces_where(surface.triangles, [&](Index f) { return keep[at(pieces.of_face[at(f)])]; });
  drop_unused_points(surface.points, surface.triangles);
  return {std::move(surface.points), std::move(surface.triangles)};
}

TriangleMesh meshed(const TriangleMesh& surface, const Asked& asked) {
  try {
    TriangleMesh mesh = remeshed_surface(surface, EdgeSizing(asked.edge), std::numbers::pi);
    const auto crossings = self_intersections(mesh);
    if (!crossings.empty()) {
      throw NumericalError(fmt::format("{}: the resulting skin intersects itself: {}; try another length",
                                       asked.value(), self_intersections_text(mesh, crossings, crossings.size() + 1)));
    }
    return mesh;
  } catch (const RemeshError& error) {
    throw InputError(fmt::format("{}: {}", asked.value(), error.what()));
  }
}

/// From the points of a surface that count to the nearest of another.
template <class Counts>
SurfaceDistance surface_distance(const TriangleMesh& from, const FaceTree& to, double spacing, const Counts& counts) {
  constexpr double kMostPoints = 1e6;
  const SkinPatches pieces = pieces_of(from, std::max(spacing, std::sqrt(4.0 * from.total_area() / kMostPoints)), 0);
  const Points points = pieces.centres();
  const Points normals = pieces.normals();
  std::vector<std::pair<double, Index>> order(at(pieces.size()), {-1.0, 0});
#pragma omp parallel for schedule(dynamic, 256)
  for (Index i = 0; i < pieces.size(); ++i) {
    if (counts(points.col(i), normals.col(i))) {
      order[at(i)] = {to.nearest(points.col(i)).distance, i};
    }
  }
  std::erase_if(order, [](const auto& point) { return point.first < 0; });
  std::ranges::sort(order);
  SurfaceDistance result;
  double area = 0;
  for (const auto& [distance, i] : order) {
    area += pieces.areas(i);
    result.farthest = distance;
    result.at = points.col(i);
  }
  constexpr double kMost = 0.95;
  double below = 0;
  for (auto point = order.begin(); point != order.end() && below < kMost * area; ++point) {
    below += pieces.areas(point->second);
    result.most_of_it = point->first;
  }
  result.counted = area / from.total_area();
  return result;
}

std::string distance_text(const SurfaceDistance& distance) {
  return fmt::format("95 % within {:.2g} mm, all within {:.2g} mm (farthest at {})", distance.most_of_it / kMillimetre,
                     distance.farthest / kMillimetre, place_text(distance.at, 2));
}

/// Measures the skin against its original.
void compare(Resurfaced& result, const Asked& asked) {
  constexpr double kOff = 1e-3;     // of an edge: beside a face
  constexpr double kOutside = 0.3;  // winding numbers before an outer face, at most
  constexpr double kInside = 0.7;   // and behind it, at least
  const FaceTree skin(result.mesh);
  const FaceTree original(result.original);
  result.to_skin = surface_distance(result.original, skin, asked.edge, [&](const Vector3& x, const Vector3& normal) {
    const Vector3 off = kOff * asked.edge * normal;
    return original.winding_number(x + off) < kOutside && original.winding_number(x - off) > kInside;
  });
  result.from_skin =
      surface_distance(result.mesh, original, asked.edge, [](const Vector3&, const Vector3&) { return true; });
  if (result.to_skin.most_of_it > asked.edge) {
    throw InputError(
        fmt::format("{} is too long: parts thinner or gaps "
                    "narrower than it are lost; of the surface's "
                    "outer faces 95 % must be within an edge of "
                    "the skin and are within {:.3g} mm, the "
                    "farthest at {}",
                    asked.value(), result.to_skin.most_of_it / kMillimetre, place_text(result.to_skin.at, 2)));
  }
  result.steps.push_back(fmt::format("from the outer faces ({:.1f} % of the surface) to the skin: {}",
                                     100.0 * result.to_skin.counted, distance_text(result.to_skin)));
  result.steps.push_back(fmt::format("from the skin to the surface: {}", distance_text(result.from_skin)));
}

}  // namespace

void require_resurfaceable(const FileSurface& surface, double unit, double edge, const std::string& name,
                           const std::string& field) {
  const Asked asked{name, field, edge};
  constexpr double kMostNodes = 3e8;
  constexpr double kMostFaces = 5e6;
  if (!(asked.edge > 0 && std::isfinite(asked.edge))) {
    throw InputError(fmt::format("{} must be > 0 and finite", asked.value()));
  }
  Eigen::AlignedBox3d box;
  double area = 0;
  for (const auto& face : surface.triangles) {
    const auto corner = [&](std::size_t c) {
      return Vector3(unit * surface.points[static_cast<std::size_t>(face[c])]);
    };
    for (std::size_t c = 0; c < 3; ++c) {
      box.extend(corner(c));
    }
    area += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
  }
  if (box.isEmpty()) {
    return;
  }
  const Vector3 size = box.sizes();
  const double nodes = node_count(size, kGrid * asked.edge);
  const double faces = area / (std::sqrt(3.0) / 4.0 * asked.edge * asked.edge);
  if (nodes > kMostNodes || faces > kMostFaces) {
    const double least = 1.05 * asked.edge * std::max(std::cbrt(nodes / kMostNodes), std::sqrt(faces / kMostFaces));
    throw InputError(
        fmt::format("{} is too short for a surface of {:.4g} x {:.4g} x {:.4g} "
                    "mm and {:.4g} cm2: it would take {:.3g} nodes of a "
                    "grid, {:.0g} are allowed, and {:.3g} faces, {:.0g} are "
                    "allowed; it must be at least {:.2g} mm",
                    asked.value(), size.x() / kMillimetre, size.y() / kMillimetre, size.z() / kMillimetre, 1e4 * area,
                    nodes, kMostNodes, faces, kMostFaces, least / kMillimetre));
  }
}

Resurfaced resurfaced(const FileSurface& surface, double unit, double edge, const std::string& name,
                      const std::string& field) {
  const Asked asked{name, field, edge};
  require_resurfaceable(surface, unit, edge, name, field);
  OrientedSoup soup = oriented_soup(surface, unit, name);
  std::vector<std::string> steps = std::move(soup.steps);
  TriangleMesh mesh = meshed(outer_surface(soup.mesh, asked, steps), asked);
  const bool closed = inspect(soup.mesh.vertices(), soup.mesh.triangles()).closed();
  const std::optional<double> volume = closed ? std::optional(soup.mesh.signed_volume()) : std::nullopt;
  steps.push_back(fmt::format(
      "resurfaced with edges of {:.4g} mm: {}; area {:.1f} to {:.1f} cm2, "
      "volume {} to {}",
      edge / kMillimetre, counted(mesh.face_count(), "face", "faces"), 1e4 * soup.mesh.total_area(),
      1e4 * mesh.total_area(), volume ? volume_text(*volume) : "(open)", volume_text(mesh.signed_volume())));
  Resurfaced result{std::move(mesh), std::move(soup.mesh), {}, {}, volume, std::move(steps)};
  compare(result, asked);
  return result;
}

}  // namespace touchfield
