#pragma once

#include <string>
#include <vector>

namespace touchfield {

/// The instruction sets that the inner loops are compiled for (levels of the x86-64 psABI). All other code is compiled
/// for the plain architecture, so that one binary runs everywhere.
enum class InstructionLevel {
  kGeneric,  // not an x86-64 processor, or one from before 2009: the architecture's own baseline
  kV2,       // SSE4.2
  kV3,       // AVX2 and FMA
  kV4,       // AVX-512 F, BW, CD, DQ, VL
};

/// "generic", "v2", "v3" or "v4".
std::string to_string(InstructionLevel level);

/// The highest level that this processor and its operating system carry out, and all of its levels, ascending.
InstructionLevel processor_level();
std::vector<InstructionLevel> processor_levels();

/// The level in use: the processor's, or the lower one that the environment variable TOUCHFIELD_LEVEL names. Read once.
/// throws  std::invalid_argument if TOUCHFIELD_LEVEL is no level, or one that this processor does not carry out
InstructionLevel instruction_level();

}  // namespace touchfield
