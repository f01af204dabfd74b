#pragma once

#include <string>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

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

}  // namespace touchfield
