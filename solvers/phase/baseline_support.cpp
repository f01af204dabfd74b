#include "solvers/phase/baseline_support.h"

#include <cmath>
#include <complex>
#include <stdexcept>
#include <string>

namespace touchfield {

void require_valid(const BaselineOptions& options, const char* who) {
  if (options.iterations < 1) {
    throw std::invalid_argument(std::string(who) + ": iterations must be >= 1");
  }
}

Eigen::VectorXcd unit_start(const SkinProblem& problem, const Eigen::VectorXcd& start, const char* who) {
  if (start.size() != problem.channel_count() || !start.allFinite()) {
    throw std::invalid_argument(std::string(who) + ": the start must hold one finite drive for each channel");
  }
  return start.unaryExpr([](std::complex<double> drive) { return phasor(drive, 1.0); });
}

std::complex<double> phasor(std::complex<double> x, std::complex<double> otherwise) {
  return x == std::complex<double>(0.0) ? otherwise : std::polar(1.0, std::arg(x));
}

Eigen::VectorXd target_energy(const SkinProblem& problem) { return problem.target.rowwise().squaredNorm(); }

}  // namespace touchfield
