#pragma once

#include <stdexcept>
#include <string>

#include "solvers/phase/baselines.h"

namespace touchfield {

/// Throws as require_valid, and std::invalid_argument unless iterations >= 1; `who` begins the message.
inline void require_valid(const SkinProblem& problem, const BaselineOptions& options, const std::string& who) {
  require_valid(problem, who.c_str());
  if (options.iterations < 1) {
    throw std::invalid_argument(who + ": iterations must be >= 1");
  }
}

/// The phases of a start as unit phasors, 1 where a drive is 0.
///
/// throws   as require_valid, and std::invalid_argument on another size or a value that is not finite
inline Eigen::VectorXcd valid_start(const SkinProblem& problem, const Eigen::VectorXcd& start,
                                    const BaselineOptions& options, const std::string& who) {
  require_valid(problem, options, who);
  if (start.size() != problem.channel_count() || !start.allFinite()) {
    throw std::invalid_argument(who + ": the start must hold one finite drive for each channel");
  }
  return phasors_of(start);
}

/// sum_n |h_jn|^2 of each target face.
inline Eigen::VectorXd target_energy(const SkinProblem& problem) { return problem.target.rowwise().squaredNorm(); }

}  // namespace touchfield
