#include "sim/mesh/cut/cut.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/place_text.h"
#include "sim/mesh/cut/cap_mesh.h"
#include "sim/mesh/cut/capped_cut.h"
#include "sim/mesh/cut/clip_mesh.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

struct Plane {
  Vector3 point;
  Vector3 up;  // unit

  double height(const Vector3& x) const { return (x - point).dot(up); }
};

CapChart chart_of(const Plane& plane) {
  const Vector3 u = plane.up.unitOrthogonal();
  const Vector3 v = plane.up.cross(u);
  const Vector3 origin = plane.point;
  return {[=](const Vector3& x) { return Eigen::Vector2d((x - origin).dot(u), (x - origin).dot(v)); },
          [=](const Eigen::Vector2d& p) -> Vector3 { return origin + p.x() * u + p.y() * v; }};
}

std::vector<int> sides_of(const TriangleMesh& mesh, const Plane& plane) {
  constexpr double kOnPlane = 1e-9;  // [m]
  std::vector<int> sides;
  for (const auto& vertex : mesh.vertices().colwise()) {
    const double height = plane.height(vertex);
    sides.push_back(std::abs(height) <= kOnPlane ? 0 : height < 0 ? -1 : 1);
  }
  return sides;
}

/// Mean and largest length of the edges that the plane meets.
struct CrossedEdges {
  double mean;
  double longest;
};

CrossedEdges crossed_edges(const TriangleMesh& mesh, const std::vector<int>& sides) {
  CrossedEdges lengths{0, 0};
  double count = 0;
  const EdgeTable edges = edge_table(mesh.triangles());
  for (const auto& ends : edges.ends.colwise()) {
    if (sides[static_cast<std::size_t>(ends(0))] * sides[static_cast<std::size_t>(ends(1))] <= 0) {
      const double length = (mesh.vertices().col(ends(0)) - mesh.vertices().col(ends(1))).norm();
      lengths.mean += length;
      lengths.longest = std::max(lengths.longest, length);
      count += 1;
    }
  }
  lengths.mean /= count;
  return lengths;
}

CappedCut cut(const TriangleMesh& mesh, const Plane& plane, const std::vector<int>& sides, double edge,
              const CutCare& care) {
  const CapChart chart = chart_of(plane);
  const auto crossing = [&](const Vector3& kept, const Vector3& beyond) {
    const double below = plane.height(kept);
    return chart.onto(kept + below / (below - plane.height(beyond)) * (beyond - kept));
  };
  CappedCut part{clipped(mesh, {.sides = sides,
                                .crossing = crossing,
                                .snap = care.snap,
                                .snap_off_crease = care.snap_off_crease,
                                .movable = std::vector<bool>(sides.size(), true),
                                .parts_necks = false}),
                 0};
  part.skin_faces = static_cast<Eigen::Index>(part.surface.triangles.size());
  for (const std::vector<int>& loop : loops_of(part.surface)) {
    for (const int v : loop) {
      Vector3& x = part.surface.points[static_cast<std::size_t>(v)];
      x = chart.onto(x);
    }
  }
  add_caps(part.surface, chart);
  refine_caps(part.surface, part.skin_faces, chart, [&](const Vector3& /*x*/) { return edge; });
  return part;
}

}  // namespace

TriangleMesh cut_by_plane(const TriangleMesh& mesh, const Vector3& point, const Vector3& normal) {
  if (!point.allFinite() || !normal.allFinite() || !(normal.norm() > 0)) {
    throw InputError("mesh: the plane of a cut must have a finite point and a normal that is not 0");
  }
  const Plane plane{point, normal.normalized()};
  const std::string what = fmt::format("the cut by the plane through {} with normal ({:.3g}, {:.3g}, {:.3g})",
                                       place_text(point, 2), normal.x(), normal.y(), normal.z());
  const std::vector<int> sides = sides_of(mesh, plane);
  const auto [least, most] = std::minmax_element(sides.begin(), sides.end());
  if (*least >= 0 || *most <= 0) {
    throw InputError(fmt::format("mesh: {} leaves {} of it", what, *least >= 0 ? "nothing" : "the whole"));
  }
  const CrossedEdges edges = crossed_edges(mesh, sides);
  constexpr double kTolerance = 0.02;  // of the mean length: creases and corners of the body hardly move
  const CutPlace place{what, [&](const Vector3& x) { return std::abs(plane.height(x)) <= edges.longest; },
                       [](const Vector3& /*x*/) { return true; },
                       [&](const Vector3& /*x*/) { return kTolerance * edges.mean; }};
  return first_sound_cut({{0.25, 0.02, true}, {0.25, 0.02, false}, {1e-3, 1e-3, false}}, place,
                         [&](const CutCare& care) { return cut(mesh, plane, sides, edges.mean, care); });
}

}  // namespace touchfield
