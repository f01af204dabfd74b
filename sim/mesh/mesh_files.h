#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/core/types.h"

namespace touchfield {

/// What a mesh file says, in its own units and numbering.
struct FileSurface {
  std::vector<Vector3> points;
  std::vector<std::array<std::int64_t, 3>> triangles;
};

/// Each takes a file's whole content; `name` is how messages call the file. Coordinates are read in double precision.
/// The library's readers are not used: they crash on truncated PLY and read what is no number in OBJ as another number.
///
/// throws   InputError with line or byte if the content is cut short, is of another kind or has a coordinate that is
///          not a finite number
FileSurface parse_stl(const std::string& content, const std::string& name);
FileSurface parse_obj(const std::string& content, const std::string& name);
FileSurface parse_ply(const std::string& content, const std::string& name);

}  // namespace touchfield
