#pragma once

#include "sim/scene/body_spec.h"
#include "sim/scene/input.h"

namespace touchfield::schema {

/// Reads the table of times of a series whose keys were good: a header file,time_s (in either order) and one row per
/// mesh; # starts a comment. Files count from the series' folder. Fills in its meshes, and the first as the mesh's
/// file.
///
/// in        the map that holds `folder` and `times`
/// returns   false after a report: no such folder or file, a time that is no number or not after the one before it
bool read_mesh_times(const Input& in, MeshShape& mesh);

}  // namespace touchfield::schema
