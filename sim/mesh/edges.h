#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The edges of a mesh, numbered in the order of their lower, then higher vertex.
struct EdgeTable {
  Eigen::Matrix2Xi ends;  // 2 x E vertex indices, the lower first
  Triangles of_face;      // 3 x M: the edge between corners c and c + 1 (mod 3) of each face
};

EdgeTable edge_table(const Triangles& triangles);

}  // namespace touchfield
