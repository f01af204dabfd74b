#include "sim/acoustics/source_loops.h"

#include "sim/acoustics/source_loops_table.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

SourceLoop source_loop(InstructionLevel level) {
  switch (level) {
#ifdef __x86_64__
    case InstructionLevel::kV2:
      return v2::kSourceLoop;
    case InstructionLevel::kV3:
      return v3::kSourceLoop;
    case InstructionLevel::kV4:
      return v4::kSourceLoop;
#endif
    default:
      return generic::kSourceLoop;
  }
}

void source_values(const SourceWave& wave, const double* point, const SourceArrays& sources, int count,
                   double* values) {
  static const SourceLoop chosen = source_loop(instruction_level());
  chosen(wave, point, sources, count, values);
}

}  // namespace touchfield
