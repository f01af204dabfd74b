#include "sim/bem/grid_loops.h"

#include "solvers/linear/instruction_level.h"

namespace touchfield {

const GridLoopTable& grid_loops(InstructionLevel level) {
#ifdef __x86_64__
  static constexpr const GridLoopTable* kLevels[] = {&generic::kGridLoops, &v2::kGridLoops, &v3::kGridLoops,
                                                     &v4::kGridLoops};
  return *kLevels[static_cast<std::size_t>(level)];
#else
  return generic::kGridLoops;
#endif
}

template <>
const GridLoopTableOf<float>& grid_loops_of() {
  static const GridLoopTable& chosen = grid_loops(instruction_level());
  return chosen.of_float;
}

template <>
const GridLoopTableOf<double>& grid_loops_of() {
  static const GridLoopTable& chosen = grid_loops(instruction_level());
  return chosen.of_double;
}

}  // namespace touchfield
