#pragma once

#include <complex>
#include <random>
#include <string>
#include <utility>
#include <vector>

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
  problem.outside = 0.5 * random_matrix(rank, channels, uniform);
  problem.amplitudes.resize(faces);
  problem.weights.resize(faces);
  for (Eigen::Index j = 0; j < faces; ++j) {
    problem.amplitudes(j) = level * uniform(0.5, 1.5) * problem.target.row(j).cwiseAbs().sum();
    problem.weights(j) = uniform(0.5, 2.0);
  }
  return problem;
}

/// Problems at the ends of what there is, each with its name; `most` channels at the most.
inline std::vector<std::pair<std::string, SkinProblem>> extreme_problems(Eigen::Index most) {
  const auto usual = [] { return random_problem(6, 4, 20, 0.3, 310); };
  const auto changed = [&](auto change) {
    SkinProblem problem = usual();
    change(problem);
    return problem;
  };
  return {{"more faces than channels", random_problem(40, 0, 6, 0.3, 311)},
          {"more outside rows than channels", random_problem(2, 30, 6, 0.3, 312)},
          {"one face", random_problem(1, 3, 12, 0.3, 313)},
          {"one channel", random_problem(5, 3, 1, 0.3, 314)},
          {"one of each", random_problem(1, 0, 1, 0.3, 315)},
          {"many channels", random_problem(3, 2, most, 0.3, 316)},
          {"no outside rows", random_problem(6, 0, 20, 0.3, 317)},
          {"one face in deep shadow", changed([](SkinProblem& p) { p.target.row(2) *= 1e-6; })},
          {"all faces in deep shadow", changed([](SkinProblem& p) { p.target *= 1e-6; })},
          {"nothing wanted on a face", changed([](SkinProblem& p) { p.amplitudes(1) = 0.0; })},
          {"a million pascals", changed([](SkinProblem& p) { p.amplitudes.setConstant(1e6); })},
          {"coincident transducers", changed([](SkinProblem& p) {
             p.target.rightCols(10) = p.target.leftCols(10).eval();
             p.outside.rightCols(10) = p.outside.leftCols(10).eval();
           })},
          {"rank one", changed([](SkinProblem& p) {
             for (Eigen::Index j = 1; j < 6; ++j) {
               p.target.row(j) = std::complex<double>(0.1 * static_cast<double>(j), 0.3) * p.target.row(0);
             }
             p.outside.setZero();
           })}};
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

/// Half the gradient of the cost along the phases of q = a exp(i phi): d cost / d phi = 2 x this, N. Where |h_j q| = 0
/// and p'_j > 0 the cost has a kink; a subgradient is taken there that is not zero if the face can be reached at all.
inline Eigen::VectorXd skin_half_gradient(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  SkinField field;
  send(problem, q, field);
  Eigen::VectorXcd directions;
  const Eigen::VectorXcd phasors =
      q.unaryExpr([](std::complex<double> drive) { return std::polar(1.0, std::arg(drive)); });
  pressure_directions(problem, target_reach(problem), field, phasors, directions);
  field.target =
      problem.weights.array() * (field.target.array().abs() - problem.amplitudes.array()) * directions.array();
  Eigen::VectorXcd x;
  send_back(problem, field, x);
  return (q.array().conjugate() * x.array()).imag();  // Re(conj(i q) x)
}

}  // namespace touchfield
