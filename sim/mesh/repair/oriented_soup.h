#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

inline std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

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
