#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/place_text.h"
#include "sim/mesh/cut/cap_mesh.h"
#include "sim/mesh/cut/capped_cut.h"
#include "sim/mesh/cut/clip_mesh.h"
#include "sim/mesh/cut/cut.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/subset.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Loops = std::vector<std::vector<int>>;

/// The sphere from the point opposite to `middle`, where the plane touches it: stereographic projection.
CapChart sphere_chart(const Vector3& centre, double radius, const Vector3& middle) {
  const Vector3 u = middle.unitOrthogonal();
  const Vector3 v = middle.cross(u);
  return {[=](const Vector3& x) -> Eigen::Vector2d {
            const Vector3 d = (x - centre).normalized();
            return Eigen::Vector2d(d.dot(u), d.dot(v)) * (2 * radius / (1 + d.dot(middle)));
          },
          [=](const Eigen::Vector2d& p) -> Vector3 {
            const double share = p.squaredNorm() / (4 * radius * radius);
            const Vector3 flat = (p.x() * u + p.y() * v) / radius;
            return centre + radius / (1 + share) * (flat + (1 - share) * middle);
          }};
}

/// Faces near the sphere halved until their edges are no longer than twice the wanted length, so that the cut can
/// follow the sphere; the surface stays the same set of points.
TriangleMesh split_near_sphere(const TriangleMesh& mesh, const Vector3& centre, double radius,
                               const EdgeSizing& sizing) {
  EditMesh edit(mesh.triangles(), mesh.vertex_count());
  std::vector<Vector3> points = as_list(mesh.vertices());
  const auto point = [&](int v) -> const Vector3& { return points[static_cast<std::size_t>(v)]; };
  const auto length = [&](int side) { return (point(edit.from(side)) - point(edit.to(side))).norm(); };
  const auto longest_of = [&](int face) {
    int longest = 3 * face;
    for (int side = longest + 1; side < 3 * face + 3; ++side) {
      longest = length(side) > length(longest) ? side : longest;
    }
    return longest;
  };
  const auto is_coarse = [&](int face) {
    const Vector3 middle =
        (point(edit.from(3 * face)) + point(edit.from(3 * face + 1)) + point(edit.from(3 * face + 2))) / 3;
    double extent = 0;
    double farthest = 0;
    for (int side = 3 * face; side < 3 * face + 3; ++side) {
      extent = std::max(extent, (point(edit.from(side)) - middle).norm());
      farthest = std::max(farthest, (point(edit.from(side)) - centre).norm());
    }
    return (middle - centre).norm() - extent < radius && farthest > 0.9 * radius &&
           length(longest_of(face)) > 2 * sizing.at(middle);
  };
  for (int face = 0; 3 * face < edit.side_count(); ++face) {
    while (is_coarse(face)) {
      // Towards longer edges first: an edge is halved only if it is the longest of both its faces.
      int side = longest_of(face);
      for (int beyond = longest_of(edit.opposite(side) / 3); length(beyond) > length(side);
           beyond = longest_of(edit.opposite(side) / 3)) {
        side = beyond;
      }
      points.push_back(0.5 * (point(edit.from(side)) + point(edit.to(side))));
      edit.split(side);
    }
  }
  std::vector<int> numbers;
  Triangles triangles = edit.compact(numbers);
  return {as_columns(points)(Eigen::all, numbers), std::move(triangles)};
}

/// Which vertices the ball keeps (-1) or leaves out (1). Bulges out of the ball and dents into it that are shallower
/// than a quarter of an edge are taken for what is round them: cut off, they would leave caps thinner than a face.
std::vector<int> sides_of_sphere(const TriangleMesh& mesh, const Vector3& centre, double radius,
                                 const EdgeSizing& sizing) {
  constexpr double kShallow = 0.25;
  const auto count = static_cast<std::size_t>(mesh.vertex_count());
  std::vector<int> sides(count);
  std::vector<double> heights(count);  // above the sphere, in wanted lengths
  for (std::size_t v = 0; v < count; ++v) {
    const Vector3 x = mesh.vertices().col(static_cast<Eigen::Index>(v));
    heights[v] = ((x - centre).norm() - radius) / sizing.at(x);
    sides[v] = heights[v] > 0 ? 1 : -1;
  }
  DisjointSets parts(mesh.vertex_count());
  const EdgeTable edges = edge_table(mesh.triangles());
  for (const auto& ends : edges.ends.colwise()) {
    if (sides[static_cast<std::size_t>(ends(0))] == sides[static_cast<std::size_t>(ends(1))]) {
      parts.join(ends(0), ends(1));
    }
  }
  const auto part_of = [&](std::size_t v) {
    return static_cast<std::size_t>(parts.root(static_cast<Eigen::Index>(v)));
  };
  std::vector<double> farthest(count, 0);
  for (std::size_t v = 0; v < count; ++v) {
    double& height = farthest[part_of(v)];
    height = std::max(height, std::abs(heights[v]));
  }
  for (std::size_t v = 0; v < count; ++v) {
    sides[v] = farthest[part_of(v)] < kShallow ? -sides[v] : sides[v];
  }
  return sides;
}

Vector3 crossing_of_sphere(const Vector3& centre, double radius, const Vector3& inside, const Vector3& outside) {
  // |inside + t along - centre| = radius, the root in 0..1.
  const Vector3 along = outside - inside;
  const Vector3 from = inside - centre;
  const double a = along.squaredNorm();
  const double b = from.dot(along);
  const double c = from.squaredNorm() - radius * radius;
  const double root = std::sqrt(std::max(b * b - a * c, 0.0));
  const double t = b > 0 ? -c / (b + root) : (root - b) / a;
  return inside + std::clamp(t, 0.0, 1.0) * along;
}

/// A direction from the centre to a point of the sphere outside of the body, far from where the skin cuts the sphere.
Vector3 outward_direction(const TriangleMesh& body, const ClippedSurface& skin, const Loops& loops,
                          const Vector3& centre, double radius) {
  constexpr int kDirections = 2000;
  struct Candidate {
    double closeness;  // cosine of the angle to the nearest rim
    Vector3 direction;
    bool beside;  // on the outer side of the rim there
  };
  std::vector<Candidate> candidates(kDirections);
#pragma omp parallel for schedule(static)
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1 - (2 * i + 1.0) / kDirections;
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const double across = std::sqrt(1 - z * z);
    Candidate& candidate = candidates[static_cast<std::size_t>(i)];
    candidate = {-2, {across * std::cos(angle), across * std::sin(angle), z}, false};
    for (const std::vector<int>& loop : loops) {
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const Vector3 a = skin.points[static_cast<std::size_t>(loop[k])] - centre;
        const Vector3 b = skin.points[static_cast<std::size_t>(loop[(k + 1) % loop.size()])] - centre;
        const double closeness = (a + b).normalized().dot(candidate.direction);
        if (closeness > candidate.closeness) {
          candidate.closeness = closeness;
          candidate.beside = a.cross(b).dot(candidate.direction) < 0;
        }
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& s, const Candidate& t) { return s.closeness < t.closeness; });
  const FaceTree tree(body);
  for (const Candidate& candidate : candidates) {
    if (candidate.beside && tree.winding_number(centre + radius * candidate.direction) < 0.5) {
      return candidate.direction;
    }
  }
  throw InputError(fmt::format("mesh: the ball of {:.1f} mm around {} is almost completely inside the body",
                               radius * 1e3, place_text(centre, 2)));
}

/// Leaves out all but the piece that holds the skin next to the centre. Returns how many of its faces are skin.
Eigen::Index keep_nearest_piece(ClippedSurface& capped, std::size_t skin_faces, const Vector3& centre) {
  DisjointSets pieces(static_cast<Eigen::Index>(capped.points.size()));
  for (const auto& [a, b, c] : capped.triangles) {
    pieces.join(a, b);
    pieces.join(a, c);
  }
  ClippedSurface skin = capped;
  skin.triangles.resize(skin_faces);
  const auto nearest = static_cast<std::size_t>(FaceTree(as_mesh(skin)).nearest(centre).face);
  const Eigen::Index kept = pieces.root(capped.triangles[nearest][0]);
  const auto is_kept = [&](const std::array<int, 3>& face) { return pieces.root(face[0]) == kept; };
  const auto count = std::count_if(skin.triangles.begin(), skin.triangles.end(), is_kept);
  std::erase_if(capped.triangles, [&](const std::array<int, 3>& face) { return !is_kept(face); });
  drop_unused_points(capped);
  return static_cast<Eigen::Index>(count);
}

/// Closes the skin within the ball by the parts of the sphere in the body, and leaves of that the piece next to the
/// centre.
CappedCut capped(ClippedSurface skin, const TriangleMesh& body, const Vector3& centre, double radius,
                 const EdgeSizing& sizing) {
  const std::size_t skin_faces = skin.triangles.size();
  const Loops loops = loops_of(skin);
  const Vector3 outward = loops.empty() ? Vector3::UnitZ() : outward_direction(body, skin, loops, centre, radius);
  const CapChart chart = sphere_chart(centre, radius, -outward);
  add_caps(skin, chart);
  const Eigen::Index kept = keep_nearest_piece(skin, skin_faces, centre);
  refine_caps(skin, kept, chart, [&](const Vector3& x) { return sizing.at(x); });
  return {std::move(skin), kept};
}

}  // namespace

TriangleMesh kept_within(const TriangleMesh& mesh, const Vector3& point, double radius, const EdgeSizing& sizing) {
  if (!(radius > 0) || !std::isfinite(radius) || !point.allFinite()) {
    throw InputError(fmt::format("keep_within_mm = {} must be > 0 and finite, around a finite point", radius * 1e3));
  }
  const double distance = FaceTree(mesh).nearest(point).distance;
  if (!(distance <= 0.5 * radius)) {
    throw InputError(
        fmt::format("keep_within_mm = {:.1f}: the nearest skin to {} is {:.1f} mm away, it must be within "
                    "half of the radius",
                    radius * 1e3, place_text(point, 2), distance * 1e3));
  }
  if ((mesh.vertices().colwise() - point).colwise().norm().maxCoeff() <= radius) {
    return mesh;
  }
  const TriangleMesh fine = split_near_sphere(mesh, point, radius, sizing);
  const std::vector<int> sides = sides_of_sphere(fine, point, radius, sizing);
  if (std::all_of(sides.begin(), sides.end(), [](int side) { return side < 0; })) {
    return mesh;
  }
  constexpr double kUntouched = 0.9;   // of the radius
  constexpr double kTolerance = 0.25;  // of the wanted edge length
  const auto may_change = [&](const Vector3& x) { return (x - point).norm() > kUntouched * radius; };
  std::vector<bool> movable;
  for (const auto& vertex : fine.vertices().colwise()) {
    movable.push_back(may_change(vertex));
  }
  const auto crossing = [&](const Vector3& kept, const Vector3& beyond) {
    return crossing_of_sphere(point, radius, kept, beyond);
  };
  const CutPlace place{fmt::format("keep_within_mm = {:.1f} around {}", radius * 1e3, place_text(point, 2)),
                       [&](const Vector3& x) { return std::abs((x - point).norm() - radius) <= 4 * sizing.at(x); },
                       may_change, [&](const Vector3& x) { return kTolerance * sizing.at(x); }};
  return first_sound_cut({{0.35, 0.15, true}, {0.35, 0.15, false}, {0.02, 0.02, false}}, place,
                         [&](const CutCare& care) {
                           return capped(clipped(fine, {.sides = sides,
                                                        .crossing = crossing,
                                                        .snap = care.snap,
                                                        .snap_off_crease = care.snap_off_crease,
                                                        .movable = movable}),
                                         mesh, point, radius, sizing);
                         });
}

}  // namespace touchfield
