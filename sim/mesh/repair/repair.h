#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/repair/surface_distance.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// How a file's surface becomes a skin.
struct RepairOptions {
  bool keeps_faces = true;     // where they make a skin; else all are replaced
  std::optional<double> edge;  // of new faces [m]; by default the mean edge of the file's faces, but at least a
                               // 300th and at most a 64th of the body's size
};

struct Repaired {
  TriangleMesh mesh;
  std::vector<std::string> steps;          // what was done, a line each with counts; empty if there was nothing to do
  std::optional<SurfaceDistance> to_skin;  // of new faces: from the file's outer faces to them, and back
  std::optional<SurfaceDistance> from_skin;
};

/// Makes a closed, manifold, outwardly oriented surface that does not cut itself of a file's surface. Faces stay if
/// this makes a skin of them:
///
/// 1. points with equal coordinates are merged; dropped are points that no face names, faces without three corners and
///    duplicates;
/// 2. pieces below a hundredth of the largest one's area are dropped;
/// 3. the faces of each piece are made to run the same way round as most of its faces do;
/// 4. slivers without area are flipped away, or collapsed if they are needles;
/// 5. pieces are turned outwards, and those inside another dropped, for no sound reaches them.
///
/// Parts that no step needs to touch stay as they are, to the bit. If holes, flaps, faces that cut each other or other
/// faults are left, all faces of the file are replaced by a new skin (resurface.h). Its small pieces are dropped as
/// in 2.
///
/// surface   as read
/// unit      metres per file unit, > 0
/// name      how messages call the surface, e.g. its file
/// throws    InputError if no face has an area, or faces that should stay are not orientable; as resurfaced()
Repaired repaired(const FileSurface& surface, double unit, const RepairOptions& options, const std::string& name);

/// The mesh of a file that is a closed surface already. Points with equal coordinates are merged. Faces with two
/// corners in one point are left out. Faces without area (as TriangleMesh counts them) are flipped or collapsed away,
/// and with them all others that are almost as flat. A surface without such faces stays as it is, to the bit.
///
/// surface   as read
/// unit      metres per file unit, > 0
/// name      the file, for messages
/// throws    InputError that names the faults left: holes and the like, or faces without area that cannot be removed
Repaired closed_mesh(const FileSurface& surface, double unit, const std::string& name);

}  // namespace touchfield
