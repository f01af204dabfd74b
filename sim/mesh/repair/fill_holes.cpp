#include "sim/mesh/repair/fill_holes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <unordered_map>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

/// The side 3 f + c of the other face at each side's edge, -1 at the boundary.
std::vector<Eigen::Index> opposite_sides(const Triangles& triangles) {
  std::vector<Eigen::Index> opposite(static_cast<std::size_t>(triangles.size()), -1);
  for_each_edge(sorted_sides(triangles), [&](std::span<const Side> edge) {
    const Side& one = edge.front();
    if (one.low == one.high) {
      throw InputError(fmt::format("mesh: face {} names vertex {} twice", one.face, one.low));
    }
    const auto upwards = std::ranges::count_if(edge, &Side::upwards);
    if (upwards > 1 || std::ssize(edge) - upwards > 1) {
      throw InputError(fmt::format("mesh: two faces run the same way along the edge from vertex {} to {}",
                                   upwards > 1 ? one.low : one.high, upwards > 1 ? one.high : one.low));
    }
    if (edge.size() == 2) {
      opposite[static_cast<std::size_t>(one.number())] = edge[1].number();
      opposite[static_cast<std::size_t>(edge[1].number())] = one.number();
    }
  });
  return opposite;
}

/// Cuts a closed walk at the vertices that it passes twice.
void add_simple_loops(const std::vector<int>& walk, std::vector<int>& place, std::vector<std::vector<int>>& loops) {
  std::vector<int> open;
  for (const int v : walk) {
    int& at = place[static_cast<std::size_t>(v)];
    if (at >= 0) {
      const auto first = open.begin() + at;
      for (auto later = first + 1; later != open.end(); ++later) {
        place[static_cast<std::size_t>(*later)] = -1;
      }
      loops.emplace_back(first, open.end());
      open.erase(first + 1, open.end());
    } else {
      at = static_cast<int>(open.size());
      open.push_back(v);
    }
  }
  for (const int v : open) {
    place[static_cast<std::size_t>(v)] = -1;
  }
  loops.push_back(std::move(open));
}

constexpr int kMostVertices = 2000;
constexpr int kManyVertices = 100;    // from here on threads pay
constexpr double kBendStep = 1e-4;    // bends are equal within this, of 1 - cos
constexpr int kFolded = 20001;        // steps, of a face without area: above 2 / kBendStep
constexpr int kDoubled = 20002;       // of an edge that the surface has already
constexpr double kShortEdges = 1e-6;  // how much the squared edges count beside the areas

/// How good a triangulation is: the bend counts first.
struct Weight {
  int bend = 0;  // the largest, in steps
  double area = 0;

  bool operator<(const Weight& other) const { return bend != other.bend ? bend < other.bend : area < other.area; }
};

/// Dynamic programming over the parts of a loop between its corners i < k.
class LoopFilling {
 public:
  LoopFilling(const Points& points, const std::vector<int>& loop, const Triangles& around)
      : size_(static_cast<int>(loop.size())), parts_(loop.size() * (loop.size() - 1) / 2) {
    corners_.reserve(loop.size());
    for (const int v : loop) {
      corners_.emplace_back(points.col(v));
    }
    note_surface(points, loop, around);
  }

  std::vector<std::array<int, 3>> best() {
    for (int span = 2; span < size_; ++span) {
#pragma omp parallel for schedule(static) if (size_ > kManyVertices)
      for (int i = 0; i < size_ - span; ++i) {
        choose(i, i + span);
      }
    }
    std::vector<std::array<int, 3>> triangles;
    std::vector<std::pair<int, int>> open = {{0, size_ - 1}};
    while (!open.empty()) {
      const auto [i, k] = open.back();
      open.pop_back();
      if (k - i > 1) {
        const int m = part(i, k).apex;
        triangles.push_back({i, m, k});
        open.emplace_back(m, k);
        open.emplace_back(i, m);
      }
    }
    return triangles;
  }

 private:
  struct Part {
    Weight weight;
    Vector3 normal = Vector3::Zero();  // of the face at its chord, or beyond its edge; 0 if there is none
    int apex = -1;
    bool doubled = false;  // the chord is an edge of the surface
  };

  Part& part(int i, int k) { return parts_[index(i, k)]; }
  const Part& part(int i, int k) const { return parts_[index(i, k)]; }
  std::size_t index(int i, int k) const {
    const auto low = static_cast<std::size_t>(i);
    return low * (2 * static_cast<std::size_t>(size_) - low - 1) / 2 + static_cast<std::size_t>(k - i - 1);
  }
  const Vector3& corner(int i) const { return corners_[static_cast<std::size_t>(i)]; }

  /// Notes the normals beyond the loop's edges and which chords are edges of the surface.
  void note_surface(const Points& points, const std::vector<int>& loop, const Triangles& around) {
    std::unordered_map<int, int> place;
    for (int i = 0; i < size_; ++i) {
      place.emplace(loop[static_cast<std::size_t>(i)], i);
    }
    for (const auto& face : around.colwise()) {
      for (int c = 0; c < 3; ++c) {
        const auto from = place.find(face(c));
        const auto to = place.find(face((c + 1) % 3));
        if (from == place.end() || to == place.end() || from->second == to->second) {
          continue;
        }
        const auto [low, high] = std::minmax(from->second, to->second);
        Part& chord = part(low, high);
        if (high - low > 1 && high - low < size_ - 1) {
          chord.doubled = true;
        } else {
          const Vector3 a = points.col(face(0));
          const Vector3 normal = (Vector3(points.col(face(1))) - a).cross(Vector3(points.col(face(2))) - a);
          (high - low == 1 ? chord.normal : normal_beyond_last_) = normal.normalized();
        }
      }
    }
  }

  static int bend(const Vector3& one, const Vector3& other) {
    if (one.isZero(0) || other.isZero(0)) {
      return 0;
    }
    return static_cast<int>((1.0 - one.dot(other)) / kBendStep);
  }

  void choose(int i, int k) {
    Part& chosen = part(i, k);
    const bool whole = k - i == size_ - 1;
    Weight best{std::numeric_limits<int>::max(), 0};
    for (int m = i + 1; m < k; ++m) {
      const Part& left = part(i, m);
      const Part& right = part(m, k);
      Weight weight{std::max(left.weight.bend, right.weight.bend), left.weight.area + right.weight.area};
      if (best < weight) {
        continue;
      }
      const Vector3 first = corner(m) - corner(i);
      const Vector3 second = corner(k) - corner(m);
      const double edges = first.squaredNorm() + second.squaredNorm();
      Vector3 normal = first.cross(second);
      const double twice_area = normal.norm();
      weight.area += 0.5 * twice_area + kShortEdges * edges;
      constexpr double kNoArea = 1e-9;  // of the squared edges
      if (twice_area > kNoArea * edges) {
        normal /= twice_area;
        weight.bend = std::max({weight.bend, bend(normal, left.normal), bend(normal, right.normal),
                                whole ? bend(normal, normal_beyond_last_) : 0});
      } else {
        normal.setZero();
        weight.bend = std::max(weight.bend, kFolded);
      }
      if (chosen.doubled) {
        weight.bend = std::max(weight.bend, kDoubled);
      }
      if (weight < best) {
        best = weight;
        chosen.apex = m;
        chosen.normal = normal;
      }
    }
    chosen.weight = best;
  }

  int size_;
  std::vector<Vector3> corners_;
  std::vector<Part> parts_;
  Vector3 normal_beyond_last_ = Vector3::Zero();
};

}  // namespace

std::vector<std::vector<int>> boundary_loops(const Triangles& triangles, int vertex_count) {
  const std::vector<Eigen::Index> opposites = opposite_sides(triangles);
  const auto opposite = [&](Eigen::Index side) { return opposites[static_cast<std::size_t>(side)]; };
  const auto next = [](Eigen::Index side) { return side % 3 == 2 ? side - 2 : side + 1; };

  std::vector<std::vector<int>> loops;
  std::vector<bool> done(static_cast<std::size_t>(triangles.size()), false);
  std::vector<int> place(static_cast<std::size_t>(vertex_count), -1);
  for (Eigen::Index first = 0; first < triangles.size(); ++first) {
    if (done[static_cast<std::size_t>(first)] || opposite(first) >= 0) {
      continue;
    }
    // Along the boundary as the faces run, round the fan of faces at each vertex; a filling runs the other way.
    std::vector<int> walk;
    Eigen::Index side = first;
    do {
      done[static_cast<std::size_t>(side)] = true;
      walk.push_back(triangles(side % 3, side / 3));
      side = next(side);
      for (Eigen::Index beyond = opposite(side); beyond >= 0; beyond = opposite(side)) {
        side = next(beyond);
      }
    } while (side != first);
    std::reverse(walk.begin(), walk.end());
    add_simple_loops(walk, place, loops);
  }
  return loops;
}

std::vector<std::array<int, 3>> fill_loop(const Points& points, const std::vector<int>& loop, const Triangles& around) {
  if (loop.size() > static_cast<std::size_t>(kMostVertices)) {
    throw InputError(
        fmt::format("mesh: a hole with {} edges is too large to fill, at most {}", loop.size(), kMostVertices));
  }
  if (loop.size() < 3) {
    throw InputError(fmt::format("mesh: a hole must have 3 edges or more, not {}", loop.size()));
  }
  std::vector<std::array<int, 3>> triangles = LoopFilling(points, loop, around).best();
  for (std::array<int, 3>& triangle : triangles) {
    for (int& corner : triangle) {
      corner = loop[static_cast<std::size_t>(corner)];
    }
  }
  return triangles;
}

}  // namespace touchfield
