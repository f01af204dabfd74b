#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "sim/mesh/topology.h"
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

/// A part of a surface connected by edges.
struct Piece {
  Eigen::Index face;   // its first
  Eigen::Index faces;  // how many
  double area;         // [m2]
  double volume;       // signed [m3]; of a meaning only if the piece is closed and its faces run the same way round

  /// Its faces lie back to back: the volume is nothing but rounding.
  bool flat() const;
};

struct Pieces {
  std::vector<int> of_face;  // the piece of each face
  std::vector<Piece> list;   // in the order of their first faces
};

/// sides   sorted_sides(triangles)
/// most    edges of more faces connect nothing
Pieces find_pieces(const Points& points, const Triangles& triangles, const std::vector<Side>& sides,
                   std::size_t most = std::numeric_limits<std::size_t>::max());

/// Whether each piece lies inside another one, where no sound from outside reaches it. The outer piece then winds round
/// every face of the inner piece, and no face of one cuts a face of the other. Pieces that overlap are not nested.
///
/// pieces   closed, each consistently oriented, inwards or outwards
std::vector<bool> nested(const Points& points, const Triangles& triangles, const Pieces& pieces);

/// How two faces i, j look at each other: if n_i . n_j < -0.5 and the line between their centroids is within 60 degrees
/// of both normals, through the air if it leaves i along n_i, else through the body.
enum class Facing { kNot, kThroughAir, kThroughBody };
Facing facing(const TriangleMesh& mesh, Eigen::Index i, Eigen::Index j);

/// What makes boundary elements untrustworthy on a mesh, each with its worst place. The local edge of a face is the
/// side of the equilateral triangle of its area.
struct MeshRisks {
  double size_jump;       // largest ratio of the local edges of two faces that share an edge, >= 1
  double size_range;      // longest edge over shortest edge
  double smallest_angle;  // [rad]
  double gap;             // least distance between the centroids of two faces that look at each other through the air,
                          // over the larger of their local edges; +inf if above 5
  double thickness;       // the same through the body
  Vector3 jump_at;        // [m], middle of the edge
  Vector3 angle_at;       // [m], the vertex
  Vector3 gap_at;         // [m], midway between the centroids; NaN if gap is +inf
  Vector3 thickness_at;   // [m], the same
  double gap_edge;        // [m], the larger local edge there
  double thickness_edge;  // [m], the same
};

/// mesh   closed or open
MeshRisks mesh_risks(const TriangleMesh& mesh);

}  // namespace touchfield
