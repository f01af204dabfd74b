#include "sim/mesh/remesh/remesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

constexpr double kLongest = 4.0 / 3.0;   // of the wanted length: longer edges are split into halves above 2/3,
constexpr double kShortest = 4.0 / 5.0;  // shorter ones collapsed; the two cannot undo each other
constexpr double kMostSplits = 20;       // for each face that an edge has room for: more are splits without end
constexpr double kSameSide = 0.5;        // cosine by which a face may turn when its neighbourhood changes
constexpr double kCoplanar = 0.7;        // cosine between two faces whose common edge may flip
constexpr double kFlattest = 0.05;       // twice the area over the longest edge squared, of a face with a shape

// How far the factor on the wanted lengths may go from 1: where creases or thin parts keep faces small, no length of
// the others makes up for their number.
constexpr double kMostScale = 1.25;

/// Where a vertex may go: kFree on the surface, kFixed nowhere, or along the crease of that number.
constexpr int kFree = -1;
constexpr int kFixed = -2;

/// The mesh while it changes. The label of an edge is the number of its crease.
class Remesher {
 public:
  Remesher(const Points& vertices, const Triangles& triangles, const CreasedTarget& target)
      : target_(target), mesh_(triangles, vertices.cols()), points_(as_list(vertices)) {
    bound_to_.assign(points_.size(), kFree);
    along_.assign(points_.size(), 0.0);
    for (const Crease& crease : target.creases) {
      mark(crease);
    }
    for (const int tip : target.tips) {
      bound_to_[static_cast<std::size_t>(tip)] = kFixed;
    }
  }

  void round() {
    ask_wanted_lengths();
    split_long_edges();
    collapse_short_edges();
    flip_towards_valence_six();
    smooth_and_project();
  }

  /// Corrects the factor on the wanted lengths so that the number of faces tends to that of equilateral ones.
  void correct_scale() {
    ask_wanted_lengths();
    scale_ = std::clamp(scale_ * std::sqrt(faces_per_wanted_face()), 1.0 / kMostScale, kMostScale);
  }

  /// Shape alone: no vertex comes or goes.
  void polish() {
    constexpr int kRounds = 3;
    for (int i = 0; i < kRounds; ++i) {
      flip_towards_valence_six();
      smooth_and_project();
    }
    flip_where([&](int side) { return angle_improves(side); });
    smooth_and_project();
  }

  /// Where the surface is sharp, moving vertices leaves some in one line or one place: such faces are opened last.
  CreasedMesh result() {
    constexpr double kFlat = 1e-6;  // area over longest edge squared
    remove_flat_faces(mesh_, as_columns(points_), kFlat);
    std::vector<int> numbers;
    Triangles triangles = mesh_.compact(numbers);
    std::vector<char> held;
    for (const int v : numbers) {
      held.push_back(bound_to(v) != kFree);
    }
    Points points = gathered(numbers);
    for (const auto& face : triangles.colwise()) {
      if (is_flat(points, face)) {
        throw RemeshError("a face without area is left", points.col(face(0)),
                          wanted(numbers[static_cast<std::size_t>(face(0))]));
      }
    }
    return {TriangleMesh(std::move(points), std::move(triangles)), std::move(held)};
  }

 private:
  const Vector3& point(int v) const { return points_[static_cast<std::size_t>(v)]; }
  Vector3& point(int v) { return points_[static_cast<std::size_t>(v)]; }
  double wanted(int v) const { return wanted_[static_cast<std::size_t>(v)] * scale_; }
  int bound_to(int v) const { return bound_to_[static_cast<std::size_t>(v)]; }
  double along(int v) const { return along_[static_cast<std::size_t>(v)]; }

  void mark(const Crease& crease) {
    const auto number = static_cast<int>(lines_.size());
    const std::vector<int>& path = crease.vertices;
    lines_.emplace_back(gathered(path));
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      mesh_.set_label(mesh_.side_between(path[i], path[i + 1]), number);
      bound_to_[static_cast<std::size_t>(path[i])] = i == 0 ? kFixed : number;
      along_[static_cast<std::size_t>(path[i])] = lines_.back().length_to(i);
    }
    bound_to_[static_cast<std::size_t>(path.back())] = kFixed;
  }

  /// Length along a crease to the ends of one of its edges. The start of a ring is also its end: the nearer one counts.
  std::pair<double, double> span(int side) const {
    const int a = mesh_.from(side);
    const int b = mesh_.to(side);
    const auto number = static_cast<std::size_t>(mesh_.label(side));
    const Crease& crease = target_.creases[number];
    const double length = lines_[number].length();
    const auto end = [&](int v, int other) {
      const bool first = crease.ring() ? along(other) < 0.5 * length : v == crease.vertices.front();
      return first ? 0.0 : length;
    };
    return {bound_to(a) == kFixed ? end(a, b) : along(a), bound_to(b) == kFixed ? end(b, a) : along(b)};
  }

  double length_over_wanted(int side) const {
    const int a = mesh_.from(side);
    const int b = mesh_.to(side);
    return (point(a) - point(b)).norm() / (0.5 * (wanted(a) + wanted(b)));
  }

  Vector3 twice_area(int a, int b, int c) const { return (point(b) - point(a)).cross(point(c) - point(a)); }

  Vector3 twice_area(int side) const { return twice_area(mesh_.from(side), mesh_.to(side), mesh_.apex(side)); }

  Points gathered(const std::vector<int>& numbers) const { return as_columns(points_)(Eigen::all, numbers); }

  std::vector<int> living() const {
    std::vector<int> numbers;
    for (int v = 0; v < mesh_.vertex_count(); ++v) {
      if (mesh_.vertex_alive(v)) {
        numbers.push_back(v);
      }
    }
    return numbers;
  }

  void ask_wanted_lengths() {
    const std::vector<int> numbers = living();
    const Eigen::VectorXd lengths = target_.edge_length(gathered(numbers));
    wanted_.resize(points_.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      wanted_[static_cast<std::size_t>(numbers[i])] = lengths(static_cast<Eigen::Index>(i));
    }
  }

  /// Over the faces that no crease holds.
  double faces_per_wanted_face() const {
    double faces = 0;
    double wanted_faces = 0;
    for (int side = 0; side < mesh_.side_count(); side += 3) {
      if (mesh_.alive(side) && bound_to(mesh_.from(side)) == kFree && bound_to(mesh_.from(side + 1)) == kFree &&
          bound_to(mesh_.from(side + 2)) == kFree) {
        double length = 0;
        for (int c = 0; c < 3; ++c) {
          length += wanted_[static_cast<std::size_t>(mesh_.from(side + c))] / 3.0;
        }
        faces += 1;
        wanted_faces += 0.5 * twice_area(side).norm() / (std::sqrt(3.0) / 4.0 * length * length);
      }
    }
    return wanted_faces > 0 ? faces / wanted_faces : 1.0;
  }

  /// Splits the longest edge about first: halves of edges that are not leave slivers, and with them no end of
  /// splitting.
  void split_long_edges() {
    double left = 0;
    for (int side = 0; side < mesh_.side_count(); ++side) {
      left += mesh_.alive(side) ? kMostSplits * (1 + std::pow(length_over_wanted(side), 2)) : 0;
    }
    for (int side = 0; side < mesh_.side_count(); ++side) {
      while (mesh_.alive(side) && length_over_wanted(side) > kLongest) {
        // Along a crease that folds back on itself, round a sheet without thickness, halves are as long as the whole.
        if (--left < 0) {
          throw RemeshError("splitting has no end", point(mesh_.from(side)), wanted(mesh_.from(side)));
        }
        split(longest_about(side));
      }
    }
  }

  void split(int side) {
    const int a = mesh_.from(side);
    const int b = mesh_.to(side);
    const int crease = mesh_.label(side);
    Vector3 middle = 0.5 * (point(a) + point(b));
    double length = 0;
    if (crease != EditMesh::kNoLabel) {
      const auto [from, to] = span(side);
      length = 0.5 * (from + to);
      middle = lines_[static_cast<std::size_t>(crease)].at(length);
    }
    const double wanted = 0.5 * (wanted_[static_cast<std::size_t>(a)] + wanted_[static_cast<std::size_t>(b)]);
    mesh_.split(side);
    points_.push_back(middle);
    wanted_.push_back(wanted);
    bound_to_.push_back(crease == EditMesh::kNoLabel ? kFree : crease);
    along_.push_back(length);
  }

  /// From face to face over ever longer edges until the edge is the longest of both its faces.
  int longest_about(int side) const {
    double length = length_over_wanted(side);
    for (bool found = true; found;) {
      found = false;
      const int other = mesh_.opposite(side);
      for (const int candidate :
           {EditMesh::next(side), EditMesh::previous(side), EditMesh::next(other), EditMesh::previous(other)}) {
        if (length_over_wanted(candidate) > length) {
          length = length_over_wanted(candidate);
          side = candidate;
          found = true;
        }
      }
    }
    return side;
  }

  /// Moves one end into the other, never to the middle: a chain of middles would sink below the surface.
  void collapse_short_edges() {
    for (int side = 0; side < mesh_.side_count(); ++side) {
      if (mesh_.alive(side) && length_over_wanted(side) < kShortest && keeps_creases(side) &&
          mesh_.can_collapse(side) && can_move(mesh_.from(side), mesh_.to(side))) {
        mesh_.collapse(side);
      }
    }
  }

  /// Whether a side's start may move into its end: along its crease only, and not onto another crease's edge.
  bool keeps_creases(int side) const {
    const auto on_crease = [&](int other) { return mesh_.label(other) != EditMesh::kNoLabel; };
    const auto both = [&](int one) { return on_crease(EditMesh::next(one)) && on_crease(EditMesh::previous(one)); };
    const int start = bound_to(mesh_.from(side));
    return start == kFree ||
           (start != kFixed && mesh_.label(side) == start && !both(side) && !both(mesh_.opposite(side)));
  }

  /// Whether vertex v may move into its neighbour `merged`: no edge gets too long, no face turns over.
  bool can_move(int v, int merged) const {
    const Vector3& x = point(merged);
    for (const int side : mesh_.around(v)) {
      const int b = mesh_.to(side);
      const int c = mesh_.apex(side);
      if ((point(b) - x).norm() > kLongest * 0.5 * (wanted(v) + wanted(b)) && b != merged) {
        return false;
      }
      if (b != merged && c != merged) {
        const Vector3 before = twice_area(side);
        const Vector3 after = (point(b) - x).cross(point(c) - x);
        if (after.dot(before) < kSameSide * after.norm() * before.norm() || flat_on_creases(merged, b, c)) {
          return false;
        }
      }
    }
    return true;
  }

  /// Whether a face would lie on creases with all its corners, nearly in one line: nothing could open it again.
  bool flat_on_creases(int a, int b, int c) const {
    return bound_to(a) != kFree && bound_to(b) != kFree && bound_to(c) != kFree && flatness(a, b, c) < kFlattest;
  }

  /// Twice the area over the longest side squared: 0.87 for an equilateral triangle, 0 for three points in a line.
  double flatness(int a, int b, int c) const {
    const double longest = std::max({(point(b) - point(a)).squaredNorm(), (point(c) - point(b)).squaredNorm(),
                                     (point(a) - point(c)).squaredNorm()});
    return twice_area(a, b, c).norm() / longest;
  }

  template <class Improves>
  void flip_where(const Improves& improves) {
    for (int side = 0; side < mesh_.side_count(); ++side) {
      if (may_flip(side) && improves(side) && keeps_shape(side) && mesh_.can_flip(side)) {
        mesh_.flip(side);
      }
    }
  }
  void flip_towards_valence_six() {
    flip_where([&](int side) { return valence_improves(side); });
  }

  /// Every edge is asked about once.
  bool may_flip(int side) const {
    return mesh_.alive(side) && side < mesh_.opposite(side) && mesh_.label(side) == EditMesh::kNoLabel;
  }

  bool valence_improves(int side) const {
    const auto excess = [&](int v, int change) { return std::abs(mesh_.valence(v) + change - 6); };
    const auto [a, b, c, d] = mesh_.corners_about(side);
    return excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1) <
           excess(a, 0) + excess(b, 0) + excess(c, 0) + excess(d, 0);
  }

  bool angle_improves(int side) const {
    const auto [a, b, c, d] = mesh_.corners_about(side);
    const auto angle = [&](int one, int two, int three) {
      return smallest_angle(point(one), point(two), point(three));
    };
    return std::min(angle(d, c, a), angle(c, d, b)) > std::min(angle(a, b, c), angle(b, a, d));
  }

  /// Whether a flip keeps the two faces on their side of the surface: they are nearly in one plane and stay so.
  bool keeps_shape(int side) const {
    const auto [a, b, c, d] = mesh_.corners_about(side);
    const Vector3 first = twice_area(a, b, c).normalized();
    const Vector3 second = twice_area(b, a, d).normalized();
    const Vector3 mean = (first + second).normalized();
    return first.dot(second) > kCoplanar && twice_area(d, c, a).normalized().dot(mean) > kCoplanar &&
           twice_area(c, d, b).normalized().dot(mean) > kCoplanar && !flat_on_creases(d, c, a) &&
           !flat_on_creases(c, d, b);
  }

  void smooth_and_project() {
    std::vector<int> free;
    std::vector<int> bound;
    for (const int v : living()) {
      if (bound_to(v) == kFree) {
        free.push_back(v);
      } else if (bound_to(v) != kFixed) {
        bound.push_back(v);
      }
    }
    const auto count = static_cast<Eigen::Index>(free.size());
    const Points before = gathered(free);
    Points moved(3, count);
    Points normals(3, count);
#pragma omp parallel for schedule(static)
    for (Eigen::Index i = 0; i < count; ++i) {
      const int v = free[static_cast<std::size_t>(i)];
      normals.col(i) = normal_at(v);
      moved.col(i) = smoothed(v, normals.col(i));
    }
    target_.project(moved, before, normals);
#pragma omp parallel for schedule(static)
    for (Eigen::Index i = 0; i < count; ++i) {
      if (turns_a_held_face(free[static_cast<std::size_t>(i)], moved.col(i))) {
        moved.col(i) = before.col(i);
      }
    }
    std::vector<double> lengths;
    for (const int v : bound) {
      lengths.push_back(smoothed_along(v));
    }
    for (Eigen::Index i = 0; i < count; ++i) {
      point(free[static_cast<std::size_t>(i)]) = moved.col(i);
    }
    for (std::size_t i = 0; i < bound.size(); ++i) {
      along_[static_cast<std::size_t>(bound[i])] = lengths[i];
      point(bound[i]) = lines_[static_cast<std::size_t>(bound_to(bound[i]))].at(lengths[i]);
    }
  }

  /// Whether a well-shaped face that creases hold on would turn by more than can_move allows if vertex v moved to x.
  /// Held vertices do not give way when a neighbour is pulled across them.
  bool turns_a_held_face(int v, const Vector3& x) const {
    for (const int side : mesh_.around(v)) {
      const int b = mesh_.to(side);
      const int c = mesh_.apex(side);
      if (bound_to(b) != kFree || bound_to(c) != kFree) {
        const Vector3 before = twice_area(side);
        const Vector3 after = (point(b) - x).cross(point(c) - x);
        if (after.dot(before) < kSameSide * after.norm() * before.norm() && flatness(v, b, c) > kFlattest) {
          return true;
        }
      }
    }
    return false;
  }

  Vector3 normal_at(int v) const {
    Vector3 normal = Vector3::Zero();
    for (const int side : mesh_.around(v)) {
      normal += twice_area(side);
    }
    return normal.normalized();
  }

  /// The mean of a vertex's neighbours, brought back into its tangent plane.
  Vector3 smoothed(int v, const Vector3& normal) const {
    Vector3 mean = Vector3::Zero();
    for (const int side : mesh_.around(v)) {
      mean += point(mesh_.to(side));
    }
    const Vector3 shift = mean / mesh_.valence(v) - point(v);
    return point(v) + shift - normal * normal.dot(shift);
  }

  /// Between its two neighbours on the crease, so that both edges are the same share of what is wanted.
  double smoothed_along(int v) const {
    std::array<double, 2> length{};
    std::array<double, 2> room{};
    std::size_t count = 0;
    for (const int side : mesh_.around(v)) {
      if (count < 2 && mesh_.label(side) == bound_to(v)) {
        length[count] = span(side).second;
        room[count++] = wanted(v) + wanted(mesh_.to(side));
      }
    }
    return (length[0] * room[1] + length[1] * room[0]) / (room[0] + room[1]);
  }

  const CreasedTarget& target_;
  EditMesh mesh_;
  std::vector<Vector3> points_;
  std::vector<double> wanted_;
  std::vector<int> bound_to_;
  std::vector<double> along_;  // length along the crease, of vertices bound to one
  std::vector<Polyline> lines_;
  double scale_ = 1.0;
};

}  // namespace

RemeshError::RemeshError(const std::string& what, const Vector3& at, double edge)
    : NumericalError(fmt::format("remesh: edges of {:.3g} mm are too long for the body at {}: {}; use edges of at most "
                                 "{:.2g} mm there",
                                 edge / kMillimetre, place_text(at, 2), what, 0.5 * edge / kMillimetre)),
      at_(at) {}

CreasedMesh remeshed(const Points& vertices, const Triangles& triangles, const CreasedTarget& target, int rounds) {
  Remesher remesher(vertices, triangles, target);
  for (int i = 0; i < rounds; ++i) {
    remesher.round();
    remesher.correct_scale();
  }
  remesher.polish();
  return remesher.result();
}

TriangleMesh remeshed(const Points& vertices, const Triangles& triangles, const RemeshTarget& target, int rounds) {
  const CreasedTarget smooth{
      target.edge_length, [&](Points& moved, const Points&, const Points&) { target.project(moved); }, {}, {}};
  return remeshed(vertices, triangles, smooth, rounds).mesh;
}

}  // namespace touchfield
