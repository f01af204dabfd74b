#include "solvers/phase/skin_field.h"

#include <cmath>
#include <complex>

#include <cblas.h>

namespace touchfield {

namespace {

constexpr double kSilence = 1e-13;  // some hundred roundings of a sum of N = 1,500 terms of both signs

/// y = op(A) x + beta y with the first `rows` > 0 rows of A.
void multiply(CBLAS_TRANSPOSE transpose, const Eigen::MatrixXcd& a, Eigen::Index rows, const Eigen::VectorXcd& x,
              double beta, Eigen::VectorXcd& y) {
  const std::complex<double> one = 1.0;
  const std::complex<double> scale = beta;
  cblas_zgemv(CblasColMajor, transpose, static_cast<int>(rows), static_cast<int>(a.cols()), &one, a.data(),
              static_cast<int>(a.rows()), x.data(), 1, &scale, y.data(), 1);
}

std::complex<double> silent_direction(const SkinProblem& problem, Eigen::Index j, const Eigen::VectorXcd& phasors) {
  std::complex<double> squares = 0.0;
  std::complex<double> leaning = 0.0;
  for (Eigen::Index n = 0; n < phasors.size(); ++n) {
    const std::complex<double> c = std::complex<double>(0, 1) * problem.target(j, n) * phasors(n);
    squares += c * c;
    leaning += std::abs(c) * c;
  }
  const std::complex<double> direction = std::polar(1.0, 0.5 * std::arg(squares));
  return (std::conj(direction) * leaning).real() < 0 ? -direction : direction;
}

}  // namespace

void send(const SkinProblem& problem, const Eigen::VectorXcd& q, SkinField& field) {
  send(problem, q, problem.quiet.rows(), field);
}

void send(const SkinProblem& problem, const Eigen::VectorXcd& q, Eigen::Index quiet_rows, SkinField& field) {
  field.target.resize(problem.target.rows());
  field.quiet.resize(quiet_rows);
  multiply(CblasNoTrans, problem.target, problem.target.rows(), q, 0.0, field.target);
  if (quiet_rows > 0) {
    multiply(CblasNoTrans, problem.quiet, quiet_rows, q, 0.0, field.quiet);
  }
}

void send_back(const SkinProblem& problem, const SkinField& v, Eigen::VectorXcd& x) {
  x.resize(problem.channel_count());
  multiply(CblasConjTrans, problem.target, problem.target.rows(), v.target, 0.0, x);
  if (v.quiet.size() > 0) {
    multiply(CblasConjTrans, problem.quiet, v.quiet.size(), v.quiet, 1.0, x);
  }
}

double field_cost(const SkinProblem& problem, const SkinField& field) {
  const auto misfit = field.target.array().abs() - problem.amplitudes.array();
  return (problem.weights.array() * misfit.square()).sum() + field.quiet.squaredNorm();
}

Eigen::VectorXd target_reach(const SkinProblem& problem) { return problem.target.cwiseAbs().rowwise().sum(); }

void pressure_directions(const SkinProblem& problem, const Eigen::VectorXd& reach, const SkinField& field,
                         const Eigen::VectorXcd& phasors, Eigen::VectorXcd& directions) {
  directions.resize(field.target.size());
  for (Eigen::Index j = 0; j < directions.size(); ++j) {
    const double magnitude = std::abs(field.target(j));
    directions(j) =
        magnitude > kSilence * reach(j) ? field.target(j) / magnitude : silent_direction(problem, j, phasors);
  }
}

}  // namespace touchfield
