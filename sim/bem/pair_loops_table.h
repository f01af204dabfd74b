#pragma once

#include "sim/bem/pair_loops.h"

namespace touchfield {

enum class InstructionLevel;  // its header brings inline functions, which level files must not hold

/// The loops over pairs as compiled for one instruction level. pair_loops_level.cpp makes one table a level;
/// pair_loops.cpp chooses among them when the program runs.
template <typename Real>
struct PairLoopTableOf {
  decltype(&pair_values<Real>) values;
  decltype(&add_mutual_sums<Real>) add_mutual;
  decltype(&pair_products<Real>) products;
};

struct PairLoopTable {
  PairLoopTableOf<float> of_float;
  PairLoopTableOf<double> of_double;
  decltype(&static_values) fixed_values;
  decltype(&static_sum) fixed_sum;
  decltype(&near_sources) near;
};

namespace generic {
extern const PairLoopTable kPairLoops;
}  // namespace generic
namespace v2 {
extern const PairLoopTable kPairLoops;
}  // namespace v2
namespace v3 {
extern const PairLoopTable kPairLoops;
}  // namespace v3
namespace v4 {
extern const PairLoopTable kPairLoops;
}  // namespace v4

/// The loops of one level, which the processor must carry out.
const PairLoopTable& pair_loops(InstructionLevel level);

}  // namespace touchfield
