#include "sim/bem/pair_loops.h"

#include <cstddef>

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

}  // namespace touchfield
