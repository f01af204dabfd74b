#pragma once

#include <cstdint>
#include <vector>

#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

/// Adds polygons as triangles, once all points are known; a polygon of four corners or more need not be convex, and
/// one without area becomes triangles without area.
///
/// polygons   corners as numbers of the surface's points
/// throws     InputError "name: face ..." on fewer than 3 corners or more than 5000, a corner that is no point, or a
/// polygon that cuts itself
void add_polygons(FileSurface& surface, const std::vector<std::vector<std::int64_t>>& polygons,
                  const std::string& name);

}  // namespace touchfield
