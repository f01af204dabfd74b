#include "sim/target/skin_reduction.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/hermitian_eigen.h"

namespace touchfield {

SkinReduction reduced_skin_problem(const Eigen::MatrixXcd& pressures, const Eigen::MatrixXcd& drives,
                                   const Eigen::VectorXd& areas, const Target& target, double quiet_weight,
                                   double tolerance) {
  if (pressures.cols() != drives.cols() || pressures.rows() != areas.size() ||
      target.amplitudes.size() != target.size()) {
    throw std::invalid_argument("reduced_skin_problem: the sizes do not fit");
  }
  const Eigen::MatrixXcd rows = pressures(target.faces, Eigen::all);
  SkinReduction reduction;
  SkinProblem& problem = reduction.problem;
  problem.target = adjoint_product(rows.adjoint(), drives.adjoint());
  problem.amplitudes = target.amplitudes;
  problem.weights = areas(target.faces);
  problem.quiet.resize(0, drives.rows());
  if (!(quiet_weight > 0)) {
    return reduction;
  }
  const Eigen::MatrixXcd weighted = quiet_weights(areas, target, quiet_weight).cwiseSqrt().asDiagonal() * pressures;
  const HermitianEigen eigen = hermitian_eigen(hermitian_product(weighted));
  const Eigen::VectorXd values = eigen.values.cwiseMax(0.0);
  const double total = values.sum();
  const double least = tolerance * tolerance * values.tail(1).sum();
  const auto dropped = static_cast<Eigen::Index>(
      std::count_if(values.begin(), values.end(), [&](double value) { return value <= least; }));
  const Eigen::Index rank = values.size() - dropped;
  const Eigen::MatrixXcd scaled = (eigen.vectors.rightCols(rank) * values.tail(rank).cwiseSqrt().asDiagonal())
                                      .rowwise()
                                      .reverse();  // strongest first
  problem.quiet = adjoint_product(scaled, drives.adjoint());
  reduction.left_out = total > 0 ? std::sqrt(values.head(dropped).sum() / total) : 0.0;
  return reduction;
}

Eigen::VectorXd quiet_weights(const Eigen::VectorXd& areas, const Target& target, double quiet_weight) {
  Eigen::VectorXd weights = quiet_weight * areas;
  weights(target.faces).setZero();
  return weights;
}

}  // namespace touchfield
