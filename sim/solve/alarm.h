#pragma once

#include "sim/solve/skin_scattering.h"

namespace touchfield {

/// Seconds that fictitious_alarm would take: 15 products of burton_miller, or the 60 steps of paper_corrected, which
/// hardly ever reaches its tolerance on a hand.
///
/// plain     whether the run's own scheme is a plain one
/// product   seconds of a product on its mesh (speed.h)
double alarm_seconds(bool plain, double product);

/// Whether a scheme has a cure for fictitious frequencies: Burton-Miller's terms or interior points.
bool has_cure(Scheme scheme);

/// Whether the alarm is computed, in a run that has spent so many seconds on solving.
bool wants_alarm(AlarmChoice choice, double seconds, double spent);

/// The alarm for fictitious frequencies: how far the pressures of a plain and of a Burton-Miller scheme are apart for
/// one drive,
///
///   || p_plain - p_bm || / || p_bm ||, area-weighted.
///
/// The run's own solution is one of the two; the other, paper_corrected or burton_miller, is solved by products like
/// the run's, or matrix-free, to 1e-3 in at most 60 steps. `auto` leaves it out where that would take longer than half
/// of what the run has spent solving, but for half a second.
///
/// cured     a model of the same body by a Burton-Miller scheme, if the run has one: stands in for burton_miller where
///           the run's own scheme is a plain one; may be null
/// own       the pressures that `scattering` found for the drive, M [Pa]
/// spent     seconds the run has spent on solving so far
/// returns   NaN if it was left out
double fictitious_alarm(const SkinScattering& scattering, SkinScattering* cured, const SolverSpec& spec,
                        const Eigen::VectorXcd& drive, const Eigen::VectorXcd& own, double spent,
                        std::vector<SolveRecord>& records, Progress& progress);

}  // namespace touchfield
