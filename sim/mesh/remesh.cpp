#include "sim/mesh/remesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <Eigen/Geometry>

#include "sim/mesh/edit_mesh.h"

namespace touchfield {

namespace {

constexpr double kLongest = 4.0 / 3.0;   // of the wanted length: longer edges are split into halves above 2/3,
constexpr double kShortest = 4.0 / 5.0;  // shorter ones collapsed; the two cannot undo each other
constexpr double kSameSide = 0.5;        // cosine by which a face may turn when its neighbourhood changes
constexpr double kCoplanar = 0.7;        // cosine between two faces whose common edge may flip

/// The mesh while it changes.
class Remesher {
 public:
  Remesher(const Points& vertices, const Triangles& triangles, const RemeshTarget& target)
      : target_(target), mesh_(triangles, vertices.cols()) {
    points_.reserve(static_cast<std::size_t>(2 * vertices.cols()));
    for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
      points_.emplace_back(vertices.col(v));
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
    scale_ *= std::sqrt(faces_per_wanted_face());
  }

  /// Shape alone: no vertex comes or goes.
  void polish() {
    constexpr int kRounds = 3;
    for (int i = 0; i < kRounds; ++i) {
      flip_towards_valence_six();
      smooth_and_project();
    }
    flip_towards_larger_angles();
    smooth_and_project();
  }

  TriangleMesh result() const {
    std::vector<int> numbers;
    Triangles triangles = mesh_.compact(numbers);
    return {gathered(numbers), std::move(triangles)};
  }

 private:
  const Vector3& point(int v) const { return points_[static_cast<std::size_t>(v)]; }
  Vector3& point(int v) { return points_[static_cast<std::size_t>(v)]; }
  double wanted(int v) const { return wanted_[static_cast<std::size_t>(v)] * scale_; }

  double length_over_wanted(int side) const {
    const int a = mesh_.from(side);
    const int b = mesh_.to(side);
    return (point(a) - point(b)).norm() / (0.5 * (wanted(a) + wanted(b)));
  }

  Vector3 twice_area(int a, int b, int c) const { return (point(b) - point(a)).cross(point(c) - point(a)); }

  Vector3 twice_area(int side) const {
    return twice_area(mesh_.from(side), mesh_.to(side), mesh_.from(EditMesh::previous(side)));
  }

  Points gathered(const std::vector<int>& numbers) const {
    Points points(3, static_cast<Eigen::Index>(numbers.size()));
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      points.col(static_cast<Eigen::Index>(i)) = point(numbers[i]);
    }
    return points;
  }

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

  double faces_per_wanted_face() const {
    double faces = 0;
    double wanted_faces = 0;
    for (int side = 0; side < mesh_.side_count(); side += 3) {
      if (mesh_.alive(side)) {
        double length = 0;
        for (int c = 0; c < 3; ++c) {
          length += wanted_[static_cast<std::size_t>(mesh_.from(side + c))] / 3.0;
        }
        faces += 1;
        wanted_faces += 0.5 * twice_area(side).norm() / (std::sqrt(3.0) / 4.0 * length * length);
      }
    }
    return faces / wanted_faces;
  }

  /// Splits the longest edge about first: halves of edges that are not leave slivers, and with them no end of
  /// splitting.
  void split_long_edges() {
    for (int side = 0; side < mesh_.side_count(); ++side) {
      while (mesh_.alive(side) && length_over_wanted(side) > kLongest) {
        const int longest = longest_about(side);
        const int a = mesh_.from(longest);
        const int b = mesh_.to(longest);
        const Vector3 middle = 0.5 * (point(a) + point(b));
        const double wanted = 0.5 * (wanted_[static_cast<std::size_t>(a)] + wanted_[static_cast<std::size_t>(b)]);
        mesh_.split(longest);
        points_.push_back(middle);
        wanted_.push_back(wanted);
      }
    }
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
      if (mesh_.alive(side) && length_over_wanted(side) < kShortest && mesh_.can_collapse(side) &&
          can_move(mesh_.from(side), mesh_.to(side))) {
        mesh_.collapse(side);
      }
    }
  }

  /// Whether vertex v may move into its neighbour `merged`: no edge gets too long, no face turns over.
  bool can_move(int v, int merged) const {
    const Vector3& x = point(merged);
    const int first = mesh_.first_around(v);
    int side = first;
    do {
      const int b = mesh_.to(side);
      const int c = mesh_.from(EditMesh::previous(side));
      if ((point(b) - x).norm() > kLongest * 0.5 * (wanted(v) + wanted(b)) && b != merged) {
        return false;
      }
      if (b != merged && c != merged) {
        const Vector3 before = twice_area(side);
        const Vector3 after = (point(b) - x).cross(point(c) - x);
        if (after.dot(before) < kSameSide * after.norm() * before.norm()) {
          return false;
        }
      }
      side = mesh_.next_around(side);
    } while (side != first);
    return true;
  }

  void flip_towards_valence_six() {
    for (int side = 0; side < mesh_.side_count(); ++side) {
      if (mesh_.alive(side) && side < mesh_.opposite(side) && valence_improves(side) && keeps_shape(side) &&
          mesh_.can_flip(side)) {
        mesh_.flip(side);
      }
    }
  }

  void flip_towards_larger_angles() {
    for (int side = 0; side < mesh_.side_count(); ++side) {
      if (mesh_.alive(side) && side < mesh_.opposite(side) && angle_improves(side) && keeps_shape(side) &&
          mesh_.can_flip(side)) {
        mesh_.flip(side);
      }
    }
  }

  bool valence_improves(int side) const {
    const auto excess = [&](int v, int change) { return std::abs(mesh_.valence(v) + change - 6); };
    const auto [a, b, c, d] = corners_about(side);
    return excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1) <
           excess(a, 0) + excess(b, 0) + excess(c, 0) + excess(d, 0);
  }

  bool angle_improves(int side) const {
    const auto [a, b, c, d] = corners_about(side);
    return std::min(least_angle(d, c, a), least_angle(c, d, b)) > std::min(least_angle(a, b, c), least_angle(b, a, d));
  }

  /// Whether a flip keeps the two faces on their side of the surface: they are nearly in one plane and stay so.
  bool keeps_shape(int side) const {
    const auto [a, b, c, d] = corners_about(side);
    const Vector3 first = twice_area(a, b, c).normalized();
    const Vector3 second = twice_area(b, a, d).normalized();
    const Vector3 mean = (first + second).normalized();
    return first.dot(second) > kCoplanar && twice_area(d, c, a).normalized().dot(mean) > kCoplanar &&
           twice_area(c, d, b).normalized().dot(mean) > kCoplanar;
  }

  /// Start and end of an edge, and the corners opposite to it.
  std::array<int, 4> corners_about(int side) const {
    return {mesh_.from(side), mesh_.to(side), mesh_.from(EditMesh::previous(side)),
            mesh_.from(EditMesh::previous(mesh_.opposite(side)))};
  }

  double least_angle(int a, int b, int c) const {
    const double area = twice_area(a, b, c).norm();
    const auto angle = [&](int at, int from, int to) {
      return std::atan2(area, (point(from) - point(at)).dot(point(to) - point(at)));
    };
    return std::min({angle(a, b, c), angle(b, c, a), angle(c, a, b)});
  }

  /// Moves every vertex to the mean of its neighbours, within its tangent plane, and back onto the surface.
  void smooth_and_project() {
    const std::vector<int> numbers = living();
    const auto count = static_cast<Eigen::Index>(numbers.size());
    Points moved(3, count);
#pragma omp parallel for schedule(static)
    for (Eigen::Index i = 0; i < count; ++i) {
      moved.col(i) = smoothed(numbers[static_cast<std::size_t>(i)]);
    }
    target_.project(moved);
    for (Eigen::Index i = 0; i < count; ++i) {
      point(numbers[static_cast<std::size_t>(i)]) = moved.col(i);
    }
  }

  Vector3 smoothed(int v) const {
    Vector3 mean = Vector3::Zero();
    Vector3 normal = Vector3::Zero();
    const int first = mesh_.first_around(v);
    int side = first;
    do {
      mean += point(mesh_.to(side));
      normal += twice_area(side);
      side = mesh_.next_around(side);
    } while (side != first);
    mean /= mesh_.valence(v);
    normal.normalize();
    const Vector3 shift = mean - point(v);
    return point(v) + shift - normal * normal.dot(shift);
  }

  const RemeshTarget& target_;
  EditMesh mesh_;
  std::vector<Vector3> points_;
  std::vector<double> wanted_;
  double scale_ = 1.0;
};

}  // namespace

TriangleMesh remeshed(const Points& vertices, const Triangles& triangles, const RemeshTarget& target, int rounds) {
  Remesher remesher(vertices, triangles, target);
  for (int i = 0; i < rounds; ++i) {
    remesher.round();
    remesher.correct_scale();
  }
  remesher.polish();
  return remesher.result();
}

}  // namespace touchfield
