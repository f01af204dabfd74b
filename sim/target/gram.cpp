#include "sim/target/gram.h"

#include <utility>

#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

/// Q from its blocks: bb = B_T^H B_T (K x K), gb = G^H B_T (N x K), gg = G^H G (N x N).
IncidentProblem assemble(const Eigen::MatrixXcd& bb, const Eigen::MatrixXcd& gb, const Eigen::MatrixXcd& gg,
                         const Eigen::VectorXd& amplitudes) {
  const Eigen::Index k = bb.rows();
  const Eigen::Index n = gg.rows();
  Eigen::MatrixXcd q(k + n, k + n);
  const auto scale = amplitudes.asDiagonal();
  q.topLeftCorner(k, k) = scale * bb * scale;
  q.bottomLeftCorner(n, k) = -gb * scale;
  q.topRightCorner(k, n) = q.bottomLeftCorner(n, k).adjoint();
  q.bottomRightCorner(n, n) = gg;
  return {std::move(q), k};
}

}  // namespace

IncidentProblem scattered_problem(const Eigen::MatrixXcd& columns, const Eigen::MatrixXcd& g,
                                  const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes) {
  return assemble(hermitian_product(columns), adjoint_product(g, columns), gram_g, amplitudes);
}

IncidentProblem unscattered_problem(const std::vector<Eigen::Index>& faces, const Eigen::MatrixXcd& g,
                                    const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes) {
  const auto k = static_cast<Eigen::Index>(faces.size());
  return assemble(Eigen::MatrixXcd::Identity(k, k), g(faces, Eigen::all).adjoint(), gram_g, amplitudes);
}

}  // namespace touchfield
