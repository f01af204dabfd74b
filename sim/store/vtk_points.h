#pragma once

#include "sim/core/types.h"

class vtkPoints;

namespace touchfield {

/// Replaces what VTK's points hold by these, in double precision.
void set_points(vtkPoints* points, const Points& columns);

}  // namespace touchfield
