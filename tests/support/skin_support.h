#pragma once

#include <complex>
#include <cstdint>
#include <random>

#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// Uniform numbers from the generator's bits, the same with every standard library.
class Uniform {
 public:
  explicit Uniform(unsigned seed) : generator_(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  std::complex<double> in_square() { return {(*this)(-1.0, 1.0), (*this)(-1.0, 1.0)}; }

 private:
  std::mt19937_64 generator_;
};

inline Eigen::MatrixXcd random_matrix(Eigen::Index rows, Eigen::Index columns, Uniform& uniform) {
  Eigen::MatrixXcd matrix(rows, columns);
  for (Eigen::Index j = 0; j < columns; ++j) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      matrix(i, j) = uniform.in_square();
    }
  }
  return matrix;
}

/// level   p' as a share of what a face hears if all channels add up
inline SkinProblem random_problem(Eigen::Index faces, Eigen::Index rank, Eigen::Index channels, double level,
                                  unsigned seed) {
  Uniform uniform(seed);
  SkinProblem problem;
  problem.target = random_matrix(faces, channels, uniform);
  problem.quiet = 0.5 * random_matrix(rank, channels, uniform);
  problem.amplitudes.resize(faces);
  problem.weights.resize(faces);
  for (Eigen::Index j = 0; j < faces; ++j) {
    problem.amplitudes(j) = level * uniform(0.5, 1.5) * problem.target.row(j).cwiseAbs().sum();
    problem.weights(j) = uniform(0.5, 2.0);
  }
  return problem;
}

/// Drives with amplitudes 0.2..1.
inline Eigen::VectorXcd random_drives(Eigen::Index channels, unsigned seed) {
  Uniform uniform(seed);
  Eigen::VectorXcd q(channels);
  for (std::complex<double>& drive : q) {
    const double amplitude = uniform(0.2, 1.0);
    drive = std::polar(amplitude, uniform(-3.14, 3.14));
  }
  return q;
}

}  // namespace touchfield
