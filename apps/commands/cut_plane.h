#pragma once

#include <string>

#include "sim/core/types.h"

namespace touchfield {

/// A plane; the side that the normal points away from is kept.
struct CutPlane {
  Vector3 point;
  Vector3 normal;
};

/// A plane as the command line says it: "x,y,z,nx,ny,nz" (a point and a normal, which points to what is cut off), or
/// "y=-20", "y<=-20" (keeps y <= -20) and "y>=-20" for planes across an axis.
///
/// returns   the plane in the text's unit
/// throws    InputError if the text is none of these, a number is not finite, or the normal is 0
CutPlane parse_cut_plane(const std::string& text);

}  // namespace touchfield
