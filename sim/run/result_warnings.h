#pragma once

#include <vector>

#include "sim/model/warnings.h"
#include "sim/run/run_data.h"

namespace touchfield {

inline constexpr double kLeastReached = 0.5;  // of the wanted mean pressure

/// Methods that are to reach the target's pressure and reach less than half of it, of a scene that says which.
std::vector<const MethodResult*> methods_below_wanted(const Run& run);

/// What a run found, in its present state.
///
/// most       the largest pressure that the array can make on the target's central face [Pa]; needed by below_wanted
/// Warnings:
///   below_wanted          a method's mean pressure on the target is below half of the wanted one; not of given phases,
///                         nor where the scene asks for the best pressure
///   not_converged         a solve that missed its tolerance
///   fictitious_frequency  a scheme without a cure for them differs from Burton-Miller by more than 10 %; a note where
///                         an evaluation with a cure has the figures
///   deep_shadow           the target is so weak that errors of the loud skin count twice or more there
///   nonlinear             a method's sound has steepened to a shock: shock_distance_share of 1 and more
/// Notes:
///   nonlinear             the same from 0.3 on
Remarks result_remarks(const Run& run, double most = kNotComputed);

}  // namespace touchfield
