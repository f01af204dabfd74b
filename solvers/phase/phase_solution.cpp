#include "solvers/phase/phase_solution.h"

#include <cmath>
#include <numbers>

namespace touchfield {

std::string to_string(PhaseStatus status) {
  switch (status) {
    case PhaseStatus::kConverged:
      return "converged";
    case PhaseStatus::kIterationLimit:
      return "iteration_limit";
    case PhaseStatus::kStalled:
      return "stalled";
    case PhaseStatus::kDirect:
      return "direct";
  }
  return {};
}

Eigen::VectorXd wrapped(const Eigen::VectorXd& phases) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return phases.unaryExpr([](double phase) {
    const double reduced = phase - kTurn * std::floor(phase / kTurn);
    return reduced < kTurn ? reduced : 0.0;  // a tiny negative phase rounds up to a whole turn
  });
}

PhaseSolution full_drive(const Eigen::VectorXd& phases, PhaseSolution solution) {
  solution.phases = wrapped(phases);
  solution.amplitudes = Eigen::VectorXd::Ones(phases.size());
  return solution;
}

Eigen::VectorXcd drive(const PhaseSolution& solution) {
  Eigen::VectorXcd q(solution.phases.size());
  for (Eigen::Index n = 0; n < q.size(); ++n) {
    q(n) = std::polar(solution.amplitudes(n), solution.phases(n));
  }
  return q;
}

std::complex<double> phasor(std::complex<double> x, std::complex<double> otherwise) {
  return x == std::complex<double>(0.0) ? otherwise : std::polar(1.0, std::arg(x));
}

Eigen::VectorXcd phasors_of(const Eigen::VectorXcd& x) {
  return x.unaryExpr([](std::complex<double> value) { return phasor(value); });
}

}  // namespace touchfield
