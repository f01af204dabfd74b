#pragma once

#include <string>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Everything that keeps points and triangles from being a scatterer's skin.
struct SkinReport {
  MeshReport mesh;                  // topology and quality of all faces
  Eigen::Index flat_faces = 0;      // without area by TriangleMesh's limit
  Eigen::Index crossings = 0;       // pairs of faces that cut each other, sought up to kMostCrossings
  double mean_edge = 0;             // of the faces with an area, as TriangleMesh counts it [m]; 0 without one
  std::vector<std::string> faults;  // one line a fault; empty if it can be a scatterer as it is

  static constexpr std::size_t kMostCrossings = 1000;
};

/// points      3 x V [m], finite
/// triangles   3 x M, each of three distinct numbers of points; M = 0 is a fault
SkinReport inspect_skin(const Points& points, const Triangles& triangles);

/// What a file's surface is like before anyone makes a mesh of it.
struct SurfaceReport {
  Eigen::Index points = 0;  // that the file says
  Eigen::Index faces = 0;
  Eigen::Index unreferenced_points = 0;  // that no face names; harmless
  Eigen::Index repeated_points = 0;      // with the coordinates of an earlier one; harmless, they count as one
  Eigen::Index collapsed_faces = 0;      // two of whose corners are one point
  Eigen::Index duplicate_faces = 0;      // with the corners of an earlier one
  SkinReport skin;                       // of the other faces, their faults first
};

/// surface   as read
/// unit      metres per file unit, > 0
/// returns   the report; skin.faults names the faults of the file's faces too
SurfaceReport inspect_surface(const FileSurface& surface, double unit);

}  // namespace touchfield
