#include "sim/field/gram.h"

#include <algorithm>
#include <complex>
#include <utility>

#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kGramRows = 2048;  // rows of G that are weighed at a time

/// Q from its blocks, W = diag(w): bb = B_T^H W B_T (K x K), gb = G^H W B_T (N x K), gg = G^H W G (N x N).
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

Eigen::VectorXd row_weights(FaceWeights faces, const Eigen::VectorXd& areas, Eigen::Index rows) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(rows);
  if (faces == FaceWeights::kArea) {
    weights.head(areas.size()) = areas / areas.mean();
  }
  return weights;
}

Eigen::MatrixXcd weighted_gram(const Eigen::MatrixXcd& g, const Eigen::VectorXd& weights) {
  if ((weights.array() == 1.0).all()) {
    return hermitian_product(g);
  }
  Eigen::MatrixXcd gram = Eigen::MatrixXcd::Zero(g.cols(), g.cols());
  const Eigen::VectorXd roots = weights.cwiseSqrt();
  for (Eigen::Index at = 0; at < g.rows(); at += kGramRows) {
    const Eigen::Index count = std::min(kGramRows, g.rows() - at);
    gram += hermitian_product(roots.segment(at, count).asDiagonal() * g.middleRows(at, count));
  }
  return gram;
}

IncidentProblem scattered_problem(const Eigen::MatrixXcd& columns, const Eigen::MatrixXcd& g,
                                  const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes,
                                  const Eigen::VectorXd& weights) {
  return assemble(weighted_gram(columns, weights), adjoint_product(g, weights.asDiagonal() * columns), gram_g,
                  amplitudes);
}

IncidentProblem unscattered_problem(const std::vector<Eigen::Index>& faces, const Eigen::MatrixXcd& g,
                                    const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes,
                                    const Eigen::VectorXd& weights) {
  const Eigen::MatrixXcd own = weights(faces).cast<std::complex<double>>().asDiagonal();
  return assemble(own, g(faces, Eigen::all).adjoint() * own, gram_g, amplitudes);
}

}  // namespace touchfield
