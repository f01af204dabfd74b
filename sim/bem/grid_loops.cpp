#include "sim/bem/grid_loops.h"

#include <cstddef>

#include "sim/bem/pair_loops.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

const PairLoopTable& pair_loops(InstructionLevel level) {
#ifdef __x86_64__
  static constexpr const PairLoopTable* kLevels[] = {&generic::kPairLoops, &v2::kPairLoops, &v3::kPairLoops,
                                                     &v4::kPairLoops};
  return *kLevels[static_cast<std::size_t>(level)];
#else
  return generic::kPairLoops;
#endif
}

const PairLoopTable& pair_loops() {
  static const PairLoopTable& chosen = pair_loops(instruction_level());
  return chosen;
}

template <>
const PairLoopTableOf<float>& pair_loops_of() {
  return pair_loops().of_float;
}

template <>
const PairLoopTableOf<double>& pair_loops_of() {
  return pair_loops().of_double;
}

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
