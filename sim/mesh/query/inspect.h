#pragma once

#include <string>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Boundary edges that hang together by their vertices.
struct Hole {
  Eigen::Index edges;
  double length;  // all its edges' [m]
  Vector3 at;     // mean of the middles of its edges [m]
};

/// What is wrong with a mesh as the skin of a scatterer, and how fine it is.
struct MeshReport {
  Eigen::Index faces = 0;
  Eigen::Index vertices = 0;
  Eigen::Index unused_vertices = 0;       // named by no triangle; harmless
  Eigen::Index boundary_edges = 0;        // edges with one face: holes
  Eigen::Index nonmanifold_edges = 0;     // edges with three faces or more
  Eigen::Index misoriented_edges = 0;     // edges whose two faces run the same way round
  Eigen::Index nonmanifold_vertices = 0;  // vertices whose faces form more than one fan
  Eigen::Index components = 0;            // pieces connected by edges
  Eigen::Index nested_pieces = 0;         // of a closed oriented surface: inside another piece, where no sound comes
  bool inside_out = false;                // closed, but the signed volume of a piece is negative
  std::vector<Hole> holes;                // the longest first
  double area = 0;                        // [m2]
  double volume = 0;                      // signed [m3]
  double shortest_edge = 0;               // [m]
  double longest_edge = 0;                // [m]
  double smallest_angle = 0;              // [rad]
  std::vector<std::string> faults;        // one line a fault, empty if the mesh is a closed oriented surface

  bool closed() const { return boundary_edges == 0 && nonmanifold_edges == 0; }
};

/// Topology and quality of a mesh. Never throws: faults are in the report. Faces that cut each other are not sought
/// (see self_intersections.h).
MeshReport inspect(const TriangleMesh& mesh);

/// The same of points [m] and triangles that are no mesh yet: faces without area are allowed.
///
/// triangles   3 x M, M > 0, each of three distinct numbers of points
MeshReport inspect(const Points& points, const Triangles& triangles);

/// A scatterer needs a closed, manifold, consistently and outwardly oriented surface, no piece of it inside another.
///
/// name     how the message calls the mesh, e.g. its file
/// throws   InputError listing every fault with its count and the place of the first
void require_closed_surface(const TriangleMesh& mesh, const std::string& name);

}  // namespace touchfield
