#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/core/errors.h"
#include "sim/mesh/remesh/creases.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What a surface is remeshed to. Both are asked for a block of points at a time.
struct RemeshTarget {
  /// Wanted edge length [m] at each of n points, > 0.
  std::function<Eigen::VectorXd(const Points&)> edge_length;
  /// Moves points that lie near the surface onto it.
  std::function<void(Points&)> project;
};

/// The wanted edges are too long for the shape about a place.
class RemeshError : public NumericalError {
 public:
  /// edge   wanted there [m]
  RemeshError(const std::string& what, const Vector3& at, double edge);

  const Vector3& at() const { return at_; }

 private:
  Vector3 at_;  // [m]
};

/// A closed manifold with nearly equilateral faces of the wanted size. A round splits edges above 4/3 of the wanted
/// length and collapses those below 4/5. It then flips edges towards valence 6, smooths within the surface and projects
/// onto it.
///
/// vertices, triangles   a closed oriented manifold; degenerate faces are allowed
/// rounds                8 settle; >= 1
/// returns   the mesh; the mean of (area / wanted area) over its faces is 1 within 2 %
/// throws    InputError if an edge does not have two faces that run opposite ways
///           RemeshError if a face without area is left, or splitting long edges has no end: parts lie on each other
/// source    Botsch and Kobbelt, A remeshing approach to multiresolution modeling, SGP 2004
TriangleMesh remeshed(const Points& vertices, const Triangles& triangles, const RemeshTarget& target, int rounds);

/// The same for a surface with creases and tips. Vertices on creases move along them only; their ends and tips stay.
struct CreasedTarget {
  std::function<Eigen::VectorXd(const Points&)> edge_length;
  /// Moves the points that no crease or tip holds onto the surface. Of each it is told where it was before it was moved
  /// along the surface, and the mesh's unit normal there.
  std::function<void(Points& moved, const Points& before, const Points& normals)> project;
  std::vector<Crease> creases;  // paths in the mesh to start with; they meet at their ends only
  std::vector<int> tips;        // vertices that stay, off the creases or at their ends
};

struct CreasedMesh {
  TriangleMesh mesh;
  std::vector<char> held;  // for each vertex, whether it is on a crease or a tip
};

CreasedMesh remeshed(const Points& vertices, const Triangles& triangles, const CreasedTarget& target, int rounds);

}  // namespace touchfield
