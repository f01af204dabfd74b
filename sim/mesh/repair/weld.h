#pragma once

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A file's surface as points [m] and triangles of three distinct points each, and what that took.
struct WeldedSurface {
  Points points;
  Triangles triangles;
  Eigen::Index unreferenced = 0;     // points that no triangle named, left out
  Eigen::Index welded = 0;           // points replaced by an earlier one
  Eigen::Index collapsed_faces = 0;  // triangles that named a point twice, at once or after welding; left out
};

/// Merges points of a file's surface that coincide and leaves out what names none.
///
/// unit        metres per file unit, > 0
/// tolerance   0: points with equal coordinates are one. Else each point in its order becomes the nearest of those
///             kept so far that is no farther away [m], or is kept itself, so that no chain of merges moves a point
///             farther than the tolerance.
/// throws      InputError on a coordinate that is not finite, a triangle that names a point that is not there, or more
///             points than an int counts
WeldedSurface welded(const FileSurface& surface, double unit, double tolerance);

/// The triangles without those that have the corners of an earlier one, in whatever order.
///
/// copied   set for each triangle left: whether one that was left out ran the other way round (a wall seen from both
///          sides)
Triangles without_duplicates(const Triangles& triangles, std::vector<bool>& copied);

}  // namespace touchfield
