#pragma once

#include "solvers/phase/baselines.h"

namespace touchfield {

/// Throws std::invalid_argument unless iterations >= 1; `who` begins the message.
void require_valid(const BaselineOptions& options, const char* who);

/// The phases of a start as unit phasors, 1 where a drive is 0.
///
/// throws   std::invalid_argument on another size or a value that is not finite
Eigen::VectorXcd unit_start(const SkinProblem& problem, const Eigen::VectorXcd& start, const char* who);

/// x / |x|, `otherwise` where x is 0.
std::complex<double> phasor(std::complex<double> x, std::complex<double> otherwise);

/// sum_n |h_jn|^2 of each target face.
Eigen::VectorXd target_energy(const SkinProblem& problem);

}  // namespace touchfield
