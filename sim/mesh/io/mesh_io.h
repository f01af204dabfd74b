#pragma once

#include <string>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Reads the points and triangles of an STL (ASCII or binary), OBJ, PLY, OFF or GLB file, in its own units. The
/// ending of the path tells the format. No point or triangle is merged or left out, except triangles that only join
/// strips. Polygons are cut into triangles.
///
/// throws    InputError if the file is missing, unreadable, damaged, of another kind, larger than mesh_files.h allows,
///           or has no face; the message names the file
FileSurface read_surface(const std::string& path);

/// Reads a surface as a mesh.
///
/// unit      metres per file unit, e.g. 1e-3 for a file in millimetres
/// returns   the mesh; vertices with equal coordinates are merged (STL has no shared vertices). No other repair.
/// throws    InputError as read_surface, or if it is not a mesh (see TriangleMesh)
TriangleMesh read_mesh(const std::string& path, double unit);

/// Writes STL (binary), OBJ, PLY (binary), OFF or VTP by the ending of the path, in file units of `unit` metres.
/// The file appears whole or not at all.
/// throws   InputError on another ending, IoError if it cannot be written
void write_mesh(const std::string& path, const TriangleMesh& mesh, double unit);

}  // namespace touchfield
