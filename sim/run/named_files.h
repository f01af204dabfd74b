#pragma once

#include <vector>

#include "sim/scene/scene.h"

namespace touchfield {

/// Reads every file that the scenes of a sweep name, each once, without building their models. Meshes are read as
/// bodies. Runs that a method starts from are compared with the channels of the array. (Files of positions and phases
/// are read with the scene.)
///
/// throws   InputError with the first problems, one line per problem: the number of the first case that has it, and
///          the problem
void require_named_files(const std::vector<Scene>& scenes);

}  // namespace touchfield
