#include "sim/bem/grid_loops.h"

#include <type_traits>

#include "solvers/linear/instruction_level.h"

namespace touchfield {

namespace {

template <typename Real>
const auto& of_precision(const auto& table) {
  if constexpr (std::is_same_v<Real, float>) {
    return table.of_float;
  } else {
    return table.of_double;
  }
}

}  // namespace

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

template <typename Real>
const PairLoopTableOf<Real>& pair_loops_of() {
  return of_precision<Real>(pair_loops());
}

template const PairLoopTableOf<float>& pair_loops_of();
template const PairLoopTableOf<double>& pair_loops_of();

const GridLoopTable& grid_loops(InstructionLevel level) {
#ifdef __x86_64__
  static constexpr const GridLoopTable* kLevels[] = {&generic::kGridLoops, &v2::kGridLoops, &v3::kGridLoops,
                                                     &v4::kGridLoops};
  return *kLevels[static_cast<std::size_t>(level)];
#else
  return generic::kGridLoops;
#endif
}

template <typename Real>
const GridLoopTableOf<Real>& grid_loops_of() {
  static const GridLoopTable& chosen = grid_loops(instruction_level());
  return of_precision<Real>(chosen);
}

template const GridLoopTableOf<float>& grid_loops_of();
template const GridLoopTableOf<double>& grid_loops_of();

}  // namespace touchfield
