#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

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
};

/// mesh   closed or open
MeshRisks mesh_risks(const TriangleMesh& mesh);

}  // namespace touchfield
