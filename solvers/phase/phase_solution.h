#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace touchfield {

/// Steps of an iterative method where nothing else is said: the published number from zero.
inline constexpr int kUsualIterations = 30;

enum class PhaseStatus {
  kConverged,       // the gradient or the step fell below its tolerance
  kIterationLimit,  // stopped at the given number of iterations
  kStalled,         // no step lowered the cost any more
  kDirect,          // the method does not iterate
};

/// The status as results spell it: converged, iteration_limit, stalled, direct.
std::string to_string(PhaseStatus status);

/// Drives found by a phase method, q_n = amplitude_n exp(i phase_n).
struct PhaseSolution {
  Eigen::VectorXd phases;            // N [rad], 0 <= phase < 2 pi
  Eigen::VectorXd amplitudes;        // N, 0..1
  std::vector<double> cost_history;  // cost before the first and after each iteration; empty for a direct method
  int iterations = 0;                // steps tried, accepted or not
  PhaseStatus status = PhaseStatus::kDirect;
};

/// Phases brought to 0 <= phase < 2 pi.
Eigen::VectorXd wrapped(const Eigen::VectorXd& phases);

/// Phases [rad] that were not iterated for, at full drive.
PhaseSolution direct_solution(const Eigen::VectorXd& phases);

/// Told after every iteration: its number from 1 and the cost reached. Empty: nobody is.
using IterationCallback = std::function<void(int iteration, double cost)>;

/// The complex drives q.
Eigen::VectorXcd drive(const PhaseSolution& solution);

}  // namespace touchfield
