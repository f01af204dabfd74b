#include "sim/mesh/cut/clip_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

#include "sim/mesh/cut/boundary_loops.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/subset.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

constexpr double kCrease = 0.64;                         // cosine between the normals of two faces
constexpr double kStraight = 0.866;                      // cosine by which a crease may bend at a vertex that moves
constexpr double kTurned = 0.8;                          // by which a face may turn when a vertex moves
constexpr double kThin = 25.0 * std::numbers::pi / 180;  // a smaller angle is not made much smaller still

class Clipper {
 public:
  Clipper(const TriangleMesh& mesh, CuttingSurface surface)
      : mesh_(mesh),
        surface_(std::move(surface)),
        rings_(mesh.triangles(), mesh.vertex_count()),
        points_(as_list(mesh.vertices())) {}

  ClippedSurface clip() {
    pushed_.assign(points_.size(), false);
    part_necks();
    snap();
    cut_faces();
    separate_fans();
    ClippedSurface kept{std::move(points_), std::move(triangles_)};
    drop_unused_points(kept);
    return kept;
  }

 private:
  struct Snap {
    double share;
    int vertex;
    int other;
  };

  int side_of(int v) const { return surface_.sides[static_cast<std::size_t>(v)]; }
  const Vector3& point(int v) const { return points_[static_cast<std::size_t>(v)]; }

  bool crosses(int a, int b) const { return side_of(a) * side_of(b) < 0; }

  bool is_pushed(int v) const { return pushed_[static_cast<std::size_t>(v)]; }

  Vector3 crossing(int a, int b) const {
    constexpr double kPushed = 0.4;  // of an edge
    if (is_pushed(a) || is_pushed(b)) {
      return is_pushed(a) ? point(a) + kPushed * (point(b) - point(a)) : point(b) + kPushed * (point(a) - point(b));
    }
    return side_of(a) < 0 ? surface_.crossing(point(a), point(b)) : surface_.crossing(point(b), point(a));
  }

  /// Vertices near the surface through which the cut would pass twice fall to the other side with what is round them.
  void part_necks() {
    for (int v = 0; v < static_cast<int>(points_.size()); ++v) {
      if (!surface_.movable[static_cast<std::size_t>(v)] || sign_changes(v) < 4) {
        continue;
      }
      bool is_near = false;
      for (const int side : rings_.around(v)) {
        const int other = rings_.to(side);
        is_near =
            is_near || (crosses(v, other) && !is_pushed(other) &&
                        (crossing(v, other) - point(v)).norm() < surface_.snap * (point(other) - point(v)).norm());
      }
      if (is_near) {
        surface_.sides[static_cast<std::size_t>(v)] = 1;
        pushed_[static_cast<std::size_t>(v)] = true;
      }
    }
  }

  /// Moves vertices onto the surface, those first that move least.
  void snap() {
    std::vector<Snap> snaps;
    for (int side = 0; side < rings_.side_count(); ++side) {
      const int v = rings_.from(side);
      const int other = rings_.to(side);
      if (crosses(v, other) && surface_.movable[static_cast<std::size_t>(v)] && !is_pushed(v)) {
        const double share = (crossing(v, other) - point(v)).norm() / (point(other) - point(v)).norm();
        if (share < surface_.snap) {
          snaps.push_back({share, v, other});
        }
      }
    }
    std::sort(snaps.begin(), snaps.end(), [](const Snap& s, const Snap& t) {
      return std::tie(s.share, s.vertex, s.other) < std::tie(t.share, t.vertex, t.other);
    });
    for (const Snap& candidate : snaps) {
      if (crosses(candidate.vertex, candidate.other)) {
        const Vector3 at = crossing(candidate.vertex, candidate.other);
        if ((candidate.share < surface_.snap_off_crease || follows_crease(candidate.vertex, candidate.other)) &&
            cut_stays_simple(candidate.vertex) && keeps_faces(candidate.vertex, at)) {
          points_[static_cast<std::size_t>(candidate.vertex)] = at;
          surface_.sides[static_cast<std::size_t>(candidate.vertex)] = 0;
        }
      }
    }
  }

  bool is_crease(int side) const {
    return mesh_.normals().col(side / 3).dot(mesh_.normals().col(rings_.opposite(side) / 3)) < kCrease;
  }

  /// A vertex on a crease may move along it, one where creases end or meet at an angle hardly anywhere.
  bool follows_crease(int v, int other) const {
    std::array<Vector3, 2> along;
    std::size_t creases = 0;
    bool on_crease = false;
    for (const int side : rings_.around(v)) {
      if (is_crease(side)) {
        const int end = rings_.to(side);
        on_crease = on_crease || end == other;
        if (creases < 2) {
          along[creases] = (mesh_.vertices().col(end) - mesh_.vertices().col(v)).normalized();
        }
        ++creases;
      }
    }
    return creases == 0 || (creases == 2 && on_crease && along[0].dot(along[1]) < -kStraight);
  }

  /// How often the vertices round one change between the two sides; those on the surface do not count.
  int sign_changes(int v) const {
    int changes = 0;
    int first = 0;
    int last = 0;
    for (const int side : rings_.around(v)) {
      const int here = side_of(rings_.to(side));
      if (here != 0) {
        first = first == 0 ? here : first;
        changes += last != 0 && here != last ? 1 : 0;
        last = here;
      }
    }
    return changes + (first != last ? 1 : 0);
  }

  /// Whether the cut would pass once through the vertex if it lay on the surface: the vertices round it on either side
  /// follow each other, and no edge of two kept faces would lie in the surface.
  bool cut_stays_simple(int v) const {
    std::vector<int> around;
    for (const int side : rings_.around(v)) {
      around.push_back(side_of(rings_.to(side)));
    }
    for (std::size_t i = 0; i < around.size(); ++i) {
      const int before = around[(i + around.size() - 1) % around.size()];
      const int after = around[(i + 1) % around.size()];
      if (around[i] == 0 && before < 0 && after < 0) {
        return false;
      }
    }
    return sign_changes(v) == 2;
  }

  bool keeps_faces(int v, const Vector3& at) const {
    bool keeps = true;
    for (const int side : rings_.around(v)) {
      const int to_b = rings_.to(side);
      const int to_c = rings_.apex(side);
      if (side_of(to_b) >= 0 && side_of(to_c) >= 0) {
        continue;  // nothing of the face would be left
      }
      const Vector3& b = point(to_b);
      const Vector3& c = point(to_c);
      const Vector3 normal = (b - at).cross(c - at);
      const double before = smallest_angle(point(v), b, c);
      keeps = keeps && normal.dot(mesh_.normals().col(side / 3)) > kTurned * normal.norm() &&
              smallest_angle(at, b, c) > std::min(kThin, 0.7 * before);
    }
    return keeps;
  }

  /// The vertex on an edge that crosses the surface, made when first asked for.
  int vertex_on(int side) {
    int& number = on_edge_[static_cast<std::size_t>(std::min(side, rings_.opposite(side)))];
    if (number < 0) {
      number = static_cast<int>(points_.size());
      points_.push_back(crossing(rings_.from(side), rings_.to(side)));
    }
    return number;
  }

  void cut_faces() {
    on_edge_.assign(static_cast<std::size_t>(rings_.side_count()), -1);
    for (int first = 0; first < rings_.side_count(); first += 3) {
      std::array<int, 4> part{};
      std::size_t count = 0;
      bool kept = false;
      for (int side = first; side < first + 3; ++side) {
        const int v = rings_.from(side);
        kept = kept || side_of(v) < 0;
        if (side_of(v) <= 0) {
          part[count++] = v;
        }
        if (crosses(v, rings_.to(side))) {
          part[count++] = vertex_on(side);
        }
      }
      if (kept && count == 3) {
        triangles_.push_back({part[0], part[1], part[2]});
      } else if (kept && count == 4) {
        add_quadrangle(part);
      }
    }
  }

  /// By the diagonal that leaves the larger smallest angle.
  void add_quadrangle(const std::array<int, 4>& q) {
    const auto angle = [&](int a, int b, int c) { return smallest_angle(point(a), point(b), point(c)); };
    if (std::min(angle(q[0], q[1], q[2]), angle(q[0], q[2], q[3])) >=
        std::min(angle(q[0], q[1], q[3]), angle(q[1], q[2], q[3]))) {
      triangles_.push_back({q[0], q[1], q[2]});
      triangles_.push_back({q[0], q[2], q[3]});
    } else {
      triangles_.push_back({q[0], q[1], q[3]});
      triangles_.push_back({q[1], q[2], q[3]});
    }
  }

  /// A vertex whose faces form several fans becomes one for each.
  void separate_fans() {
    const Triangles faces = as_columns(triangles_);
    DisjointSets sets = fans(faces, sorted_sides(faces));
    constexpr Eigen::Index kNone = -1;
    std::vector<Eigen::Index> fan(points_.size(), kNone);  // the first one of each vertex
    std::vector<int> copy(3 * triangles_.size(), -1);      // the vertex of each further one
    for (std::size_t i = 0; i < copy.size(); ++i) {
      int& v = triangles_[i / 3][i % 3];
      const Eigen::Index own = sets.root(static_cast<Eigen::Index>(i));
      Eigen::Index& first = fan[static_cast<std::size_t>(v)];
      first = first == kNone ? own : first;
      if (own != first) {
        int& number = copy[static_cast<std::size_t>(own)];
        if (number < 0) {
          number = static_cast<int>(points_.size());
          points_.push_back(Vector3(point(v)));
        }
        v = number;
      }
    }
  }

  const TriangleMesh& mesh_;
  CuttingSurface surface_;
  EditMesh rings_;
  std::vector<Vector3> points_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<int> on_edge_;  // by the lower side of the edge
  std::vector<bool> pushed_;  // vertices that the cut keeps away from
};

}  // namespace

ClippedSurface clipped(const TriangleMesh& mesh, CuttingSurface surface) {
  return Clipper(mesh, std::move(surface)).clip();
}

std::vector<std::array<int, 3>> as_triples(const Triangles& faces) {
  std::vector<std::array<int, 3>> triples;
  for (const auto& face : faces.colwise()) {
    triples.push_back({face(0), face(1), face(2)});
  }
  return triples;
}

TriangleMesh as_mesh(const ClippedSurface& surface) {
  return {as_columns(surface.points), as_columns(surface.triangles)};
}

std::vector<std::vector<int>> loops_of(const ClippedSurface& surface) {
  return boundary_loops(as_columns(surface.triangles), static_cast<int>(surface.points.size()));
}

void drop_unused_points(ClippedSurface& surface) {
  Points points = as_columns(surface.points);
  Triangles triangles = as_columns(surface.triangles);
  drop_unused_points(points, triangles);
  surface = {as_list(points), as_triples(triangles)};
}

}  // namespace touchfield
