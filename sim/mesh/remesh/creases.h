#pragma once

#include <functional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A ball [m].
struct Ball {
  Vector3 centre;
  double radius;

  bool holds(const Vector3& x) const { return (x - centre).norm() < radius; }
};

/// A path along edges of a mesh, by its vertices, at least 2. The ends are the corners where it meets others, turns
/// sharply or stops; in a ring they are one vertex.
struct Crease {
  std::vector<int> vertices;

  bool ring() const { return vertices.front() == vertices.back(); }
};

/// Where a surface is sharp: its edges between faces with normals more than `angle` apart. A rough or splintered
/// surface must not dissolve into creases. Edges that are not sharp at the scale of the wanted edge length h are
/// therefore left out:
///   - edges where the mean normals of the skin within h/2, on the two sides, are less than 3/4 of `angle` apart
///   - paths shorter than h that end in the open
/// A path has a corner where it turns by more than `angle` within h/2, and at a tip.
///
/// mesh          closed, oriented
/// angle         [rad], 0 to pi
/// edge_length   h [m] at points
/// tips          vertices
/// smooth        where no edge counts as sharp
std::vector<Crease> find_creases(const TriangleMesh& mesh, double angle,
                                 const std::function<Eigen::VectorXd(const Points&)>& edge_length,
                                 const std::vector<int>& tips = {}, const std::vector<Ball>& smooth = {});

/// Where a surface comes to a point. The angles of the faces at such a vertex leave out at least a quarter of a full
/// turn, as at the corner of a cube. The skin within h/2 must be as pointed. Its mean normal, weighted by area, is then
/// shorter than 0.8. At a cone's tip this length is the sine of half the opening angle.
///
/// smooth   where no vertex counts as a tip
std::vector<int> find_tips(const TriangleMesh& mesh, const std::function<Eigen::VectorXd(const Points&)>& edge_length,
                           const std::vector<Ball>& smooth = {});

/// A polyline by the length along it.
class Polyline {
 public:
  /// points   3 x n, n >= 2
  explicit Polyline(Points points);

  double length() const { return lengths_.back(); }
  double length_to(std::size_t vertex) const { return lengths_[vertex]; }

  /// The point at a length s along it; its ends beyond them.
  Vector3 at(double s) const;

 private:
  Points points_;
  std::vector<double> lengths_;  // from the start to each vertex
};

}  // namespace touchfield
