#pragma once

#include "sim/run/skin_scattering.h"

namespace touchfield {

/// Seconds that resonance_difference would take: 15 products of burton_miller, or the 60 steps of paper_corrected,
/// which hardly ever reaches its tolerance on a hand.
///
/// plain     whether the run's own scheme is a plain one
/// product   seconds of a product on its mesh (speed.h)
double resonance_check_seconds(bool plain, double product);

/// Whether a scheme has a cure for fictitious frequencies: Burton-Miller's terms or interior points.
bool has_cure(Scheme scheme);

/// Whether the resonance check is computed, in a run that has spent so many seconds on solving.
bool wants_resonance_check(ResonanceCheck choice, double seconds, double spent);

/// The resonance check for fictitious frequencies: the difference between the pressures of a plain and of a
/// Burton-Miller scheme for one drive,
///
///   || p_plain - p_bm || / || p_bm ||, area-weighted.
///
/// The run's own solution is one of the two. The other scheme is paper_corrected or burton_miller. It is solved to 1e-3
/// in at most 60 steps, by products with a grid if the run's products are such, else matrix-free. `auto` leaves the
/// resonance check out if it would take longer than 0.25 s and longer than half the time that the run has spent on
/// solving.
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
