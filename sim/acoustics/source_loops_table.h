#pragma once

#include "sim/acoustics/source_loops.h"

namespace touchfield {

enum class InstructionLevel;  // its header brings inline functions, which level files must not hold

using SourceLoop = decltype(&source_values);

/// source_values as source_loops_level.cpp is compiled for each instruction level.
namespace generic {
extern const SourceLoop kSourceLoop;
}  // namespace generic
namespace v2 {
extern const SourceLoop kSourceLoop;
}  // namespace v2
namespace v3 {
extern const SourceLoop kSourceLoop;
}  // namespace v3
namespace v4 {
extern const SourceLoop kSourceLoop;
}  // namespace v4

/// The loop of one level, which the processor must carry out.
SourceLoop source_loop(InstructionLevel level);

}  // namespace touchfield
