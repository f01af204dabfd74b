#pragma once

#include "solvers/linear/processor_level.h"

namespace touchfield {

/// The level in use: the processor's, or the lower one that the environment variable TOUCHFIELD_LEVEL names. Read once,
/// and before any loop, so the variables that libraries crash by are looked at here too.
///
/// throws  std::invalid_argument if TOUCHFIELD_LEVEL is no level, or one that this processor does not carry out; that
///         of require_sound_variables()
InstructionLevel instruction_level();

}  // namespace touchfield
