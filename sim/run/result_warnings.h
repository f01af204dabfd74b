#pragma once

#include <string>
#include <vector>

#include "sim/model/warnings.h"
#include "sim/run/run_data.h"
#include "sim/run/skin_scattering.h"

namespace touchfield {

inline constexpr double kLeastReached = 0.5;  // of the wanted mean pressure

/// "3.6 kPa", "4,000 kPa", "120 Pa".
std::string pressure_text(double pa);

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

/// "below_wanted: ..." of a model whose methods will reach less than half of the target's pressure, whatever they find.
/// The largest pressure is taken for twice the sound of all transducers in phase, as before a flat wall. Empty for
/// other models, and where the scene asks for the best pressure.
std::string reach_warning(const Model& model);

/// Seconds that resonance_difference would take: 15 products of burton_miller, or the 60 steps of paper_corrected,
/// which hardly ever reaches its tolerance on a hand.
///
/// plain     whether the run's own scheme is a plain one
/// product   seconds of a product on its mesh
double resonance_check_seconds(bool plain, double product);

/// Whether a scheme has a cure for fictitious frequencies on any mesh: Burton-Miller's terms. CHIEF's points leave a
/// coarse body differences of tens of percent.
bool has_cure(Scheme scheme);

/// Whether the resonance check is computed, in a run that has spent so many seconds on solving.
///
/// plain   whether the run's own scheme is a plain one
bool wants_resonance_check(ResonanceCheck choice, bool plain, double seconds, double spent);

/// The resonance check for fictitious frequencies: the difference between the pressures of a plain and of a
/// Burton-Miller scheme for one drive,
///
///   || p_plain - p_bm || / || p_bm ||, area-weighted.
///
/// The run's own solution is one of the two. The other scheme is paper_corrected or burton_miller. It is solved to 1e-3
/// in at most 60 steps, by products with a grid if the run's products are such, else matrix-free. `auto` leaves the
/// resonance check out if it would take longer than 0.25 s and longer than a share of the time spent on solving. The
/// share is a half for a plain scheme, whose warning depends on the check, and a tenth for others.
///
/// cured     a model of the same body by a Burton-Miller scheme, if the run has one; may be null. It stands in for
///           burton_miller where the run's own scheme is a plain one
/// own       the pressures that `scattering` found for the drive, M [Pa]
/// spent     seconds the run has spent on solving so far
/// returns   NaN if it was left out
double resonance_difference(const SkinScattering& scattering, SkinScattering* cured, const SolverSpec& spec,
                            const Eigen::VectorXcd& drive, const Eigen::VectorXcd& own, double spent,
                            std::vector<SolveRecord>& records, Progress& progress);

}  // namespace touchfield
