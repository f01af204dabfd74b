#include "sim/mesh/remesh/creases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

bool any_holds(const std::vector<Ball>& balls, const Vector3& x) {
  return std::ranges::any_of(balls, [&](const Ball& ball) { return ball.holds(x); });
}

/// How much of a face counts among those within `radius`: its area, but of large and long faces only what reaches in.
double area_within(const TriangleMesh& mesh, Index face, double radius) {
  const double height = 2.0 * mesh.areas()(face) / longest_edge(mesh, face);
  return std::min({mesh.areas()(face), 2.0 * radius * height, 2.0 * radius * radius});
}

/// Cosine between the mean normals of the skin about an edge on its two sides: on the face's own and the other's side
/// of the plane through the edge half-way between them.
double cosine_across(const TriangleMesh& mesh, const FaceTree& tree, const Vector3& middle, double radius,
                     const std::array<Index, 2>& sides, std::vector<Index>& found) {
  tree.centroids_within(middle, radius, found);
  const Vector3 across = mesh.normals().col(sides[0]) - mesh.normals().col(sides[1]);
  const double first = across.dot(mesh.centroids().col(sides[0]) - middle);
  std::array<Vector3, 2> sums = {Vector3::Zero(), Vector3::Zero()};
  for (const Index f : found) {
    if (f != sides[0] && f != sides[1]) {
      const bool same_side = across.dot(mesh.centroids().col(f) - middle) * first > 0;
      sums[same_side ? 0 : 1] += area_within(mesh, f, radius) * mesh.normals().col(f);
    }
  }
  for (std::size_t i = 0; i < 2; ++i) {
    sums[i] += area_within(mesh, sides[i], radius) * mesh.normals().col(sides[i]);
  }
  return sums[0].normalized().dot(sums[1].normalized());
}

/// The sharp edges as a graph over the vertices, in which paths are followed.
class SharpEdges {
 public:
  SharpEdges(const TriangleMesh& mesh, double angle, const Eigen::VectorXd& edge_length,
             const std::vector<Ball>& smooth)
      : mesh_(mesh), edge_length_(edge_length), neighbours_(at(static_cast<int>(mesh.vertex_count()))) {
    const EdgeTable edges = edge_table(mesh.triangles());
    const Index count = edges.ends.cols();
    std::vector<std::array<Index, 2>> faces(static_cast<std::size_t>(count), {-1, -1});
    for (Index f = 0; f < mesh.face_count(); ++f) {
      for (const int e : edges.of_face.col(f)) {
        faces[at(e)][faces[at(e)][0] < 0 ? 0 : 1] = f;
      }
    }
    const FaceTree tree(mesh);
    const double most_cosine = std::cos(0.75 * angle);
    std::vector<char> sharp(static_cast<std::size_t>(count), 0);
#pragma omp parallel
    {
      std::vector<Index> found;
#pragma omp for schedule(dynamic, 256)
      for (Index e = 0; e < count; ++e) {
        const auto& sides = faces[static_cast<std::size_t>(e)];
        if (mesh.normals().col(sides[0]).dot(mesh.normals().col(sides[1])) < std::cos(angle)) {
          const int a = edges.ends(0, e);
          const int b = edges.ends(1, e);
          const double radius = 0.25 * (edge_length(a) + edge_length(b));
          const Vector3 middle = 0.5 * (mesh.vertices().col(a) + mesh.vertices().col(b));
          sharp[static_cast<std::size_t>(e)] =
              !any_holds(smooth, middle) && cosine_across(mesh, tree, middle, radius, sides, found) <= most_cosine;
        }
      }
    }
    for (Index e = 0; e < count; ++e) {
      if (sharp[static_cast<std::size_t>(e)] != 0) {
        neighbours_[at(edges.ends(0, e))].push_back(edges.ends(1, e));
        neighbours_[at(edges.ends(1, e))].push_back(edges.ends(0, e));
      }
    }
  }

  /// Paths between corners, and rings.
  std::vector<Crease> paths(const std::vector<char>& corner) const {
    std::vector<Crease> found;
    std::vector<char> passed(neighbours_.size(), 0);  // inner vertices of paths
    for (int v = 0; v < static_cast<int>(neighbours_.size()); ++v) {
      if (corner[at(v)] != 0) {
        for (const int first : neighbours_[at(v)]) {
          Crease path = follow(v, first, corner);
          // Every path between corners is met from both its ends, or both ways round.
          const auto& p = path.vertices;
          if (std::pair(p.front(), p[1]) <= std::pair(p.back(), p[p.size() - 2])) {
            for (const int inner : p) {
              passed[at(inner)] = 1;
            }
            found.push_back(std::move(path));
          }
        }
      }
    }
    for (int v = 0; v < static_cast<int>(neighbours_.size()); ++v) {
      if (passed[at(v)] == 0 && corner[at(v)] == 0 && !neighbours_[at(v)].empty()) {
        Crease ring = follow(v, neighbours_[at(v)][0], corner);
        for (const int inner : ring.vertices) {
          passed[at(inner)] = 1;
        }
        found.push_back(std::move(ring));
      }
    }
    return found;
  }

  std::vector<char> forks_and_ends() const {
    std::vector<char> corner(neighbours_.size(), 0);
    for (std::size_t v = 0; v < neighbours_.size(); ++v) {
      corner[v] = !neighbours_[v].empty() && neighbours_[v].size() != 2;
    }
    return corner;
  }

  /// Removes paths with an open end that are shorter than the wanted edge, as long as there are any.
  void drop_short_ends() {
    for (bool found = true; found;) {
      found = false;
      for (const Crease& path : paths(forks_and_ends())) {
        const int front = path.vertices.front();
        const int back = path.vertices.back();
        if ((neighbours_[at(front)].size() == 1 || neighbours_[at(back)].size() == 1) &&
            length(path) < 0.5 * (edge_length_(front) + edge_length_(back))) {
          found = true;
          for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i) {
            drop(path.vertices[i], path.vertices[i + 1]);
            drop(path.vertices[i + 1], path.vertices[i]);
          }
        }
      }
    }
  }

  /// Adds the vertices where a path turns by more than `angle` to the corners, the sharpest within its reach.
  void add_turns(double angle, std::vector<char>& corner) const {
    for (const Crease& path : paths(forks_and_ends())) {
      const std::size_t count = path.vertices.size();
      std::vector<double> turn(count, 0.0);
      for (std::size_t i = path.ring() ? 0 : 1; i + 1 < count; ++i) {
        turn[i] = turn_at(path, i);
      }
      if (path.ring()) {
        turn[count - 1] = turn[0];
      }
      for (std::size_t i = 0; i < count; ++i) {
        if (turn[i] > angle && sharpest(path, turn, i)) {
          corner[at(path.vertices[i])] = 1;
        }
      }
    }
  }

 private:
  Vector3 point(int v) const { return mesh_.vertices().col(v); }

  double length(const Crease& path) const {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i) {
      sum += (point(path.vertices[i + 1]) - point(path.vertices[i])).norm();
    }
    return sum;
  }

  void drop(int from, int to) {
    auto& list = neighbours_[at(from)];
    list.erase(std::remove(list.begin(), list.end(), to), list.end());
  }

  Crease follow(int start, int first, const std::vector<char>& corner) const {
    Crease path{{start, first}};
    while (corner[at(path.vertices.back())] == 0 && path.vertices.back() != start) {
      const auto& ways = neighbours_[at(path.vertices.back())];
      const int before = path.vertices[path.vertices.size() - 2];
      path.vertices.push_back(ways[0] == before ? ways[1] : ways[0]);
    }
    return path;
  }

  /// Calls visit(index, direction) on the vertices of a path before (step -1) or after one until it answers false.
  template <class Visit>
  void walk(const Crease& path, std::size_t from, int step, const Visit& visit) const {
    const auto count = static_cast<int>(path.vertices.size());
    const int period = count - 1;  // of a ring: its last vertex is its first
    for (int steps = 1; steps < count; ++steps) {
      int i = static_cast<int>(from) + step * steps;
      if (path.ring()) {
        i = (i % period + period) % period;
      } else if (i < 0 || i >= count) {
        return;
      }
      if (!visit(at(i))) {
        return;
      }
    }
  }

  double turn_at(const Crease& path, std::size_t i) const {
    const Vector3 here = point(path.vertices[i]);
    const double reach = 0.5 * edge_length_(path.vertices[i]);
    const auto chord = [&](int step) {
      Vector3 to = Vector3::Zero();
      walk(path, i, step, [&](std::size_t j) {
        to = point(path.vertices[j]) - here;
        return to.norm() < reach;
      });
      return to;
    };
    const Vector3 ahead = chord(1);
    const Vector3 behind = -chord(-1);
    return angle_between(ahead, behind);
  }

  /// Whether no other vertex within half a wanted edge along the path turns more; of equal ones the first counts.
  bool sharpest(const Crease& path, const std::vector<double>& turn, std::size_t i) const {
    const double reach = 0.5 * edge_length_(path.vertices[i]);
    bool most = true;
    for (const int step : {-1, 1}) {
      double length = 0;
      std::size_t last = i;
      walk(path, i, step, [&](std::size_t j) {
        length += (point(path.vertices[j]) - point(path.vertices[last])).norm();
        last = j;
        if (length < reach && (turn[j] > turn[i] || (turn[j] == turn[i] && j < i))) {
          most = false;
        }
        return most && length < reach;
      });
    }
    return most;
  }

  const TriangleMesh& mesh_;
  const Eigen::VectorXd& edge_length_;
  std::vector<std::vector<int>> neighbours_;  // along sharp edges
};

}  // namespace

std::vector<Crease> find_creases(const TriangleMesh& mesh, double angle,
                                 const std::function<Eigen::VectorXd(const Points&)>& edge_length,
                                 const std::vector<int>& tips, const std::vector<Ball>& smooth) {
  const Eigen::VectorXd lengths = edge_length(mesh.vertices());
  SharpEdges edges(mesh, angle, lengths, smooth);
  edges.drop_short_ends();
  std::vector<char> corner = edges.forks_and_ends();
  edges.add_turns(angle, corner);
  for (const int tip : tips) {
    corner[at(tip)] = 1;
  }
  return edges.paths(corner);
}

std::vector<int> find_tips(const TriangleMesh& mesh, const std::function<Eigen::VectorXd(const Points&)>& edge_length,
                           const std::vector<Ball>& smooth) {
  constexpr double kLeftOut = 0.249 * 2.0 * std::numbers::pi;  // a quarter, but for rounding
  constexpr double kLongest = 0.8;
  Eigen::VectorXd angles = Eigen::VectorXd::Zero(mesh.vertex_count());
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      angles(mesh.triangles()(c, f)) += corner_angle(mesh, f, c);
    }
  }
  std::vector<int> pointed;
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    if (angles(v) > 0 && 2.0 * std::numbers::pi - angles(v) >= kLeftOut && !any_holds(smooth, mesh.vertices().col(v))) {
      pointed.push_back(static_cast<int>(v));
    }
  }
  if (pointed.empty()) {
    return {};
  }
  const FacesRound around(mesh.triangles(), mesh.vertex_count());
  const FaceTree tree(mesh);
  std::vector<int> tips;
  std::vector<Index> found;
  for (const int v : pointed) {
    const Vector3 x = mesh.vertices().col(v);
    const double radius = 0.5 * edge_length(x)(0);
    tree.centroids_within(x, radius, found);
    for (const Index f : around.of(v)) {
      if (std::find(found.begin(), found.end(), f) == found.end()) {
        found.push_back(f);
      }
    }
    Vector3 sum = Vector3::Zero();
    double area = 0;
    for (const Index f : found) {
      sum += area_within(mesh, f, radius) * mesh.normals().col(f);
      area += area_within(mesh, f, radius);
    }
    if (sum.norm() < kLongest * area) {
      tips.push_back(v);
    }
  }
  return tips;
}

Polyline::Polyline(Points points) : points_(std::move(points)), lengths_(static_cast<std::size_t>(points_.cols())) {
  for (std::size_t i = 1; i < lengths_.size(); ++i) {
    const auto col = static_cast<Index>(i);
    lengths_[i] = lengths_[i - 1] + (points_.col(col) - points_.col(col - 1)).norm();
  }
}

Vector3 Polyline::at(double s) const {
  const auto after = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, s);
  const auto end = static_cast<Index>(after - lengths_.begin());
  const double from = lengths_[static_cast<std::size_t>(end) - 1];
  const double t = std::clamp((s - from) / (*after - from), 0.0, 1.0);
  return (1.0 - t) * points_.col(end - 1) + t * points_.col(end);
}

}  // namespace touchfield
