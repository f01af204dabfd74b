#include "sim/mesh/cut/clip_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

#include "sim/mesh/cut/thin_faces.h"
#include "sim/mesh/edges.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

constexpr double kCrease = 0.64;                         // cosine between the normals of two faces
constexpr double kStraight = 0.866;                      // cosine by which a crease may bend at a vertex that moves
constexpr double kTurned = 0.8;                          // by which a face may turn when a vertex moves
constexpr double kThin = 25.0 * std::numbers::pi / 180;  // a smaller angle is not made much smaller still

/// Faces round each vertex in counter-clockwise order of a closed manifold, as sides 3 f + c that leave it.
class Rings {
 public:
  Rings(const Triangles& triangles, const EdgeTable& edges, Eigen::Index vertices)
      : first_(static_cast<std::size_t>(vertices), -1), twin_(static_cast<std::size_t>(triangles.size()), -1) {
    std::vector<Eigen::Index> seen(static_cast<std::size_t>(edges.ends.cols()), -1);
    for (Eigen::Index side = 0; side < triangles.size(); ++side) {
      first_[static_cast<std::size_t>(triangles(side % 3, side / 3))] = side;
      Eigen::Index& other = seen[static_cast<std::size_t>(edges.of_face(side % 3, side / 3))];
      if (other < 0) {
        other = side;
      } else {
        twin_[static_cast<std::size_t>(side)] = other;
        twin_[static_cast<std::size_t>(other)] = side;
      }
    }
  }

  Eigen::Index twin(Eigen::Index side) const { return twin_[static_cast<std::size_t>(side)]; }

  template <class Visit>
  void for_each_side(int vertex, const Visit& visit) const {
    const Eigen::Index first = first_[static_cast<std::size_t>(vertex)];
    if (first < 0) {
      return;
    }
    Eigen::Index side = first;
    do {
      visit(side);
      side = twin(side % 3 == 0 ? side + 2 : side - 1);
    } while (side != first);
  }

 private:
  std::vector<Eigen::Index> first_;
  std::vector<Eigen::Index> twin_;
};

class Clipper {
 public:
  Clipper(const TriangleMesh& mesh, CuttingSurface surface)
      : mesh_(mesh),
        surface_(std::move(surface)),
        edges_(edge_table(mesh.triangles())),
        rings_(mesh.triangles(), edges_, mesh.vertex_count()) {
    points_.reserve(static_cast<std::size_t>(mesh.vertex_count()));
    for (const auto& vertex : mesh.vertices().colwise()) {
      points_.emplace_back(vertex);
    }
  }

  ClippedSurface clip() {
    pushed_.assign(points_.size(), false);
    if (surface_.parts_necks) {
      part_necks();
    }
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
  int corner(Eigen::Index side) const { return mesh_.triangles()(side % 3, side / 3); }
  static Eigen::Index next(Eigen::Index side) { return side % 3 == 2 ? side - 2 : side + 1; }
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
      rings_.for_each_side(v, [&](Eigen::Index side) {
        const int other = corner(next(side));
        is_near =
            is_near || (crosses(v, other) && !is_pushed(other) &&
                        (crossing(v, other) - point(v)).norm() < surface_.snap * (point(other) - point(v)).norm());
      });
      if (is_near) {
        surface_.sides[static_cast<std::size_t>(v)] = 1;
        pushed_[static_cast<std::size_t>(v)] = true;
      }
    }
  }

  /// Moves vertices onto the surface, those first that move least.
  void snap() {
    std::vector<Snap> snaps;
    for (const auto& ends : edges_.ends.colwise()) {
      if (!crosses(ends(0), ends(1))) {
        continue;
      }
      const Vector3 at = crossing(ends(0), ends(1));
      const double length = (point(ends(0)) - point(ends(1))).norm();
      for (const auto& [v, other] : {std::pair{ends(0), ends(1)}, {ends(1), ends(0)}}) {
        const double share = (at - point(v)).norm() / length;
        if (share < surface_.snap && surface_.movable[static_cast<std::size_t>(v)] && !is_pushed(v)) {
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

  bool is_crease(Eigen::Index side) const {
    return mesh_.normals().col(side / 3).dot(mesh_.normals().col(rings_.twin(side) / 3)) < kCrease;
  }

  /// A vertex on a crease may move along it, one where creases end or meet at an angle hardly anywhere.
  bool follows_crease(int v, int other) const {
    std::array<Vector3, 2> along;
    std::size_t creases = 0;
    bool on_crease = false;
    rings_.for_each_side(v, [&](Eigen::Index side) {
      if (is_crease(side)) {
        const int end = corner(next(side));
        on_crease = on_crease || end == other;
        if (creases < 2) {
          along[creases] = (mesh_.vertices().col(end) - mesh_.vertices().col(v)).normalized();
        }
        ++creases;
      }
    });
    return creases == 0 || (creases == 2 && on_crease && along[0].dot(along[1]) < -kStraight);
  }

  /// How often the vertices round one change between the two sides; those on the surface do not count.
  int sign_changes(int v) const {
    int changes = 0;
    int first = 0;
    int last = 0;
    rings_.for_each_side(v, [&](Eigen::Index side) {
      const int here = side_of(corner(next(side)));
      if (here != 0) {
        first = first == 0 ? here : first;
        changes += last != 0 && here != last ? 1 : 0;
        last = here;
      }
    });
    return changes + (first != last ? 1 : 0);
  }

  /// Whether the cut would pass once through the vertex if it lay on the surface: the vertices round it on either side
  /// follow each other, and no edge of two kept faces would lie in the surface.
  bool cut_stays_simple(int v) const {
    std::vector<int> around;
    rings_.for_each_side(v, [&](Eigen::Index side) { around.push_back(side_of(corner(next(side)))); });
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
    rings_.for_each_side(v, [&](Eigen::Index side) {
      const int to_b = corner(next(side));
      const int to_c = corner(next(next(side)));
      if (side_of(to_b) >= 0 && side_of(to_c) >= 0) {
        return;  // nothing of the face would be left
      }
      const Vector3& b = point(to_b);
      const Vector3& c = point(to_c);
      const Vector3 normal = (b - at).cross(c - at);
      const double before = smallest_angle(point(v), b, c);
      keeps = keeps && normal.dot(mesh_.normals().col(side / 3)) > kTurned * normal.norm() &&
              smallest_angle(at, b, c) > std::min(kThin, 0.7 * before);
    });
    return keeps;
  }

  /// The vertex on an edge that crosses the surface, made when first asked for.
  int vertex_on(Eigen::Index side) {
    int& number = on_edge_[static_cast<std::size_t>(edges_.of_face(side % 3, side / 3))];
    if (number < 0) {
      number = static_cast<int>(points_.size());
      points_.push_back(crossing(corner(side), corner(next(side))));
    }
    return number;
  }

  void cut_faces() {
    on_edge_.assign(static_cast<std::size_t>(edges_.ends.cols()), -1);
    for (Eigen::Index f = 0; f < mesh_.face_count(); ++f) {
      std::array<int, 4> part{};
      std::size_t count = 0;
      bool kept = false;
      for (Eigen::Index side = 3 * f; side < 3 * f + 3; ++side) {
        const int v = corner(side);
        kept = kept || side_of(v) < 0;
        if (side_of(v) <= 0) {
          part[count++] = v;
        }
        if (crosses(v, corner(next(side)))) {
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
    struct Wing {  // a corner of a face, by its vertex and one of the two vertices beside it
      int vertex;
      int beside;
      Eigen::Index corner;
    };
    std::vector<Wing> wings;
    for (std::size_t f = 0; f < triangles_.size(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto number = static_cast<Eigen::Index>(3 * f + c);
        wings.push_back({triangles_[f][c], triangles_[f][(c + 1) % 3], number});
        wings.push_back({triangles_[f][c], triangles_[f][(c + 2) % 3], number});
      }
    }
    std::sort(wings.begin(), wings.end(), [](const Wing& s, const Wing& t) {
      return std::tie(s.vertex, s.beside, s.corner) < std::tie(t.vertex, t.beside, t.corner);
    });
    DisjointSets fans(static_cast<Eigen::Index>(3 * triangles_.size()));
    for (std::size_t i = 1; i < wings.size(); ++i) {
      if (wings[i].vertex == wings[i - 1].vertex && wings[i].beside == wings[i - 1].beside) {
        fans.join(wings[i].corner, wings[i - 1].corner);
      }
    }
    constexpr auto kNone = static_cast<std::size_t>(-1);
    std::vector<std::size_t> fan(points_.size(), kNone);  // the first one of each vertex
    std::vector<int> copy(3 * triangles_.size(), -1);     // the vertex of each further one
    for (std::size_t i = 0; i < copy.size(); ++i) {
      int& v = triangles_[i / 3][i % 3];
      const auto own = static_cast<std::size_t>(fans.root(static_cast<Eigen::Index>(i)));
      std::size_t& first = fan[static_cast<std::size_t>(v)];
      first = first == kNone ? own : first;
      if (own != first) {
        int& number = copy[own];
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
  EdgeTable edges_;
  Rings rings_;
  std::vector<Vector3> points_;
  std::vector<std::array<int, 3>> triangles_;
  std::vector<int> on_edge_;
  std::vector<bool> pushed_;  // vertices that the cut keeps away from
};

}  // namespace

ClippedSurface clipped(const TriangleMesh& mesh, CuttingSurface surface) {
  return Clipper(mesh, std::move(surface)).clip();
}

void drop_unused_points(ClippedSurface& surface) {
  std::vector<int> number(surface.points.size(), -1);
  for (const auto& triangle : surface.triangles) {
    for (const int v : triangle) {
      number[static_cast<std::size_t>(v)] = 0;
    }
  }
  std::size_t count = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == 0) {
      surface.points[count] = surface.points[v];
      number[v] = static_cast<int>(count++);
    }
  }
  surface.points.resize(count);
  for (auto& triangle : surface.triangles) {
    for (int& v : triangle) {
      v = number[static_cast<std::size_t>(v)];
    }
  }
}

}  // namespace touchfield
