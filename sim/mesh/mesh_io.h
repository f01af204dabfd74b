#pragma once

#include <string>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Reads a surface from an STL (ASCII or binary), OBJ or PLY file.
///
/// unit      metres per file unit, e.g. 1e-3 for a file in millimetres
/// returns   the mesh; vertices with equal coordinates are merged (STL has no shared vertices), polygons are
///           triangulated. No other repair.
/// throws    InputError if the file is missing, unreadable, of another kind, empty, or not a mesh (see TriangleMesh);
///           the message names the file
TriangleMesh read_mesh(const std::string& path, double unit);

/// Writes STL (binary), OBJ or PLY (binary) by the ending of the path, in file units of `unit` metres.
/// The file appears whole or not at all.
/// throws   InputError on another ending, IoError if it cannot be written
void write_mesh(const std::string& path, const TriangleMesh& mesh, double unit);

}  // namespace touchfield
