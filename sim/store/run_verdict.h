#pragma once

#include "sim/store/run_compare.h"

namespace touchfield {

/// Fills in what a difference comes to: verdict, rounding, the largest deviations and the likely causes.
void conclude(RunDifference& difference, const Run& a, const Run& b);

}  // namespace touchfield
