#pragma once

#include <cstddef>
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

struct ClosedMesh {
  TriangleMesh mesh;
  std::vector<std::string> steps;  // what was done, a line each; empty if there was nothing to do
};

/// The mesh of a file that is a closed surface already. Points with equal coordinates are merged. Faces with two
/// corners in one point are left out. Faces without area (as TriangleMesh counts them) are flipped or collapsed away,
/// and with them all others that are almost as flat. A surface without such faces stays as it is, to the bit.
///
/// surface   as read
/// unit      metres per file unit, > 0
/// name      the file, for messages
/// throws    InputError that names the faults left: holes and the like, or faces without area that cannot be removed
ClosedMesh closed_mesh(const FileSurface& surface, double unit, const std::string& name);

/// The faces of a file that have an area, each once, seen from outside as far as that can be told.
struct OrientedSoup {
  TriangleMesh mesh;
  std::vector<std::string> steps;  // what was done, a line each
};

/// Equal points become one; faces without area and those with the corners of an earlier one are dropped. Then faces are
/// turned:
///
/// - in each patch, connected by edges of two faces, to run as most of its faces do;
/// - closed patches outwards, also those with holes of up to a twentieth of their area. What is beside or in such a
///   patch says nothing of it;
/// - open patches, those with the largest areas first: against the winding number w of the patches before them (closed
///   ones, and open ones of more than twice the area) where that rises along their normals; where it does neither rise
///   nor fall, so that they bulge outwards: their volume about their own middle is positive. Flat ones stay.
///
/// surface   as read
/// unit      metres per file unit, > 0
/// name      how messages call the surface
/// throws    InputError if no face has an area
OrientedSoup oriented_soup(const FileSurface& surface, double unit, const std::string& name);

}  // namespace touchfield
