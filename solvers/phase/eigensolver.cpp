#include <cmath>
#include <complex>
#include <stdexcept>
#include <vector>

#include <Eigen/Cholesky>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/hermitian_eigen.h"
#include "solvers/phase/baseline_support.h"

namespace touchfield {

namespace {

constexpr double kLeastPrice = 1e-12;  // s_n^2 over its largest

/// The faces that take part.
std::vector<Eigen::Index> points_of(const SkinProblem& problem, const Eigen::VectorXd& energy) {
  std::vector<Eigen::Index> points;
  for (Eigen::Index j = 0; j < energy.size(); ++j) {
    if (energy(j) > 0 && problem.amplitudes(j) > 0) {
      points.push_back(j);
    }
  }
  return points;
}

/// The phases of the dominant eigenvector of H H^H D as phasors: D^(1/2) times it is the dominant eigenvector of the
/// Hermitian D^(1/2) H H^H D^(1/2).
Eigen::VectorXcd point_phasors(const Eigen::MatrixXcd& h, const Eigen::VectorXd& d) {
  const Eigen::MatrixXcd mutual = hermitian_product(h.adjoint() * d.cwiseSqrt().asDiagonal());
  const Eigen::VectorXcd dominant = hermitian_eigen(mutual).vectors.rightCols(1);
  return phasors_of(dominant);
}

}  // namespace

PhaseSolution solve_eigen(const SkinProblem& problem) {
  require_valid(problem, "solve_eigen");
  const Eigen::VectorXd energy = target_energy(problem);
  const std::vector<Eigen::Index> points = points_of(problem, energy);
  if (points.empty()) {
    return full_drive(Eigen::VectorXd::Zero(problem.channel_count()));
  }
  const Eigen::MatrixXcd h = problem.target(points, Eigen::all);
  const Eigen::VectorXd amplitudes = problem.amplitudes(points);
  Eigen::VectorXd price = h.cwiseAbs().transpose() * amplitudes / static_cast<double>(h.rows());
  price = price.cwiseMax(kLeastPrice * price.maxCoeff()).eval();

  // In the points' K x K system: q = S^-1 H^H (H S^-1 H^H + I)^-1 p' e^{i theta}, S = diag(s_n^2).
  const Eigen::MatrixXcd priced = price.cwiseSqrt().cwiseInverse().asDiagonal() * h.adjoint();
  Eigen::MatrixXcd system = hermitian_product(priced);
  system.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXcd> factors(system);
  if (factors.info() != Eigen::Success) {
    throw std::domain_error("solve_eigen: the regularised system is singular to rounding");
  }
  const Eigen::VectorXcd wanted = amplitudes.cwiseProduct(point_phasors(h, amplitudes.cwiseQuotient(energy(points))));
  const Eigen::VectorXcd q = price.cwiseInverse().asDiagonal() * (h.adjoint() * factors.solve(wanted));
  return full_drive(q.cwiseArg());
}

}  // namespace touchfield
