#pragma once

#include <complex>
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

/// Phases [rad] at full drive, with the rest of a solution.
PhaseSolution full_drive(const Eigen::VectorXd& phases, PhaseSolution solution = {});

/// Told after every iteration: its number from 1 and the cost reached. Empty: nobody is.
using IterationCallback = std::function<void(int iteration, double cost)>;

/// The complex drives q.
Eigen::VectorXcd drive(const PhaseSolution& solution);

/// x / |x|, `otherwise` where x is 0.
std::complex<double> phasor(std::complex<double> x, std::complex<double> otherwise = 1.0);
Eigen::VectorXcd phasors_of(const Eigen::VectorXcd& x);

/// Calls step(status), which gives the cost reached and may end the iteration, while the status is kIterationLimit and
/// `most` allows.
template <class Step>
void iterate(PhaseSolution& solution, int most, const IterationCallback& callback, const Step& step) {
  while (solution.status == PhaseStatus::kIterationLimit && solution.iterations < most) {
    ++solution.iterations;
    solution.cost_history.push_back(step(solution.status));
    if (callback) {
      callback(solution.iterations, solution.cost_history.back());
    }
  }
}

}  // namespace touchfield
