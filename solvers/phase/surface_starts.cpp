#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <stdexcept>

#include "solvers/phase/skin_field.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

Eigen::VectorXcd phasors_of(const Eigen::VectorXcd& drives) {
  return drives.unaryExpr([](std::complex<double> q) {
    return q == std::complex<double>(0.0) ? std::complex<double>(1.0) : std::polar(1.0, std::arg(q));
  });
}

}  // namespace

Eigen::VectorXcd adjoint_start(const SkinProblem& problem) {
  require_valid(problem, "adjoint_start");
  const SkinField wanted{(problem.weights.array() * problem.amplitudes.array()).cast<std::complex<double>>(),
                         Eigen::VectorXcd::Zero(problem.quiet.rows())};
  Eigen::VectorXcd drives;
  send_back(problem, wanted, drives);
  return phasors_of(drives);
}

Eigen::VectorXcd random_start(Eigen::Index channels, unsigned seed) {
  if (channels < 0) {
    throw std::invalid_argument("random_start: the number of channels is negative");
  }
  std::mt19937_64 generator(seed);
  Eigen::VectorXcd drives(channels);
  for (std::complex<double>& drive : drives) {
    const double share = static_cast<double>(generator() >> 11) * 0x1p-53;  // 53 bits, 0 <= share < 1
    drive = std::polar(1.0, 2.0 * std::numbers::pi * share);
  }
  return drives;
}

}  // namespace touchfield
