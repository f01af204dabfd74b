#pragma once

#include <vector>

#include "sim/scene/scene.h"

namespace touchfield {

/// Reads every file that the scenes of a sweep name, each once, without building their models: meshes as bodies, runs
/// that a method starts from against the channels of the array. (Files of positions and phases are read with the
/// scene.)
///
/// throws   InputError with the first problems, a line each: the number of the first case that has it, and what it is
void require_named_files(const std::vector<Scene>& scenes);

}  // namespace touchfield
