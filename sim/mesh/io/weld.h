#pragma once

#include <utility>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// For each point the number of the first one with its coordinates, counting only first ones; and these.
std::pair<std::vector<int>, Points> merged(const std::vector<Vector3>& points);

/// A file's surface as points [m] and triangles of three distinct points each, and what that took.
struct WeldedSurface {
  Points points;
  Triangles triangles;
  Eigen::Index unreferenced = 0;     // points that no triangle named, left out
  Eigen::Index welded = 0;           // points with the coordinates of an earlier one, which replaces them
  Eigen::Index collapsed_faces = 0;  // triangles with two corners in one point, left out
};

/// Merges points of a file's surface that have equal coordinates and leaves out what names none.
///
/// unit   metres per file unit, > 0
WeldedSurface welded(const FileSurface& surface, double unit);

/// The triangles without those that have the corners of an earlier one, in whatever order.
Triangles without_duplicates(const Triangles& triangles);

}  // namespace touchfield
