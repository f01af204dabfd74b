#include "solvers/linear/refinement.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace touchfield {

namespace {

constexpr double kLeastProgress = 0.5;  // share of the worst residual a round may leave

void check_shape(const Eigen::MatrixXcd& product, const Eigen::MatrixXcd& block) {
  if (product.rows() != block.rows() || product.cols() != block.cols()) {
    throw std::invalid_argument("refine: a product has another shape than the block it multiplies");
  }
}

double finite_norm(const Eigen::Ref<const Eigen::VectorXcd>& v, const char* what) {
  const double norm = v.stableNorm();
  if (!std::isfinite(norm)) {
    throw std::domain_error(std::string("refine: ") + what + " holds a value that is not finite");
  }
  return norm;
}

}  // namespace

RefinementResult refine(const Product& exact, const Product& approximate_inverse, const Eigen::MatrixXcd& b,
                        const RefinementOptions& options) {
  if (!(options.tolerance > 0.0) || options.max_rounds < 0) {
    throw std::invalid_argument("refine: tolerance must be > 0 and max_rounds >= 0");
  }
  const Eigen::Index n = b.rows();
  RefinementResult result;
  result.x = Eigen::MatrixXcd::Zero(n, b.cols());
  result.residuals.assign(static_cast<std::size_t>(b.cols()), 0.0);
  const auto residual = [&](Eigen::Index s) -> double& { return result.residuals[static_cast<std::size_t>(s)]; };

  Eigen::MatrixXcd directions = b;  // residual vectors, scaled to unit norm
  Eigen::VectorXd scales(b.cols());
  std::vector<Eigen::Index> active;
  const auto select = [&] {
    active.clear();
    double worst = 0.0;
    for (Eigen::Index s = 0; s < b.cols(); ++s) {
      worst = std::max(worst, residual(s));
      if (residual(s) > options.tolerance) {
        active.push_back(s);
      }
    }
    return worst;
  };

  Eigen::VectorXd norms(b.cols());
  for (Eigen::Index s = 0; s < b.cols(); ++s) {
    norms(s) = finite_norm(b.col(s), "a right-hand side");
    scales(s) = norms(s);
    if (norms(s) > 0.0) {
      residual(s) = 1.0;
      directions.col(s) /= norms(s);
    }
  }
  double worst = select();
  for (int solved = 0; !active.empty() && solved <= options.max_rounds; ++solved) {
    const Eigen::MatrixXcd block = directions(Eigen::all, active);
    Eigen::MatrixXcd x = approximate_inverse(block);
    check_shape(x, block);
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Eigen::Index s = active[static_cast<std::size_t>(i)];
      finite_norm(x.col(i), "a correction");
      x.col(i) = result.x.col(s) + scales(s) * x.col(i);
    }
    const Eigen::MatrixXcd product = exact(x);
    check_shape(product, x);
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Eigen::Index s = active[static_cast<std::size_t>(i)];
      const Eigen::VectorXcd r = b.col(s) - product.col(i);
      const double norm = finite_norm(r, "a product");
      if (norm < residual(s) * norms(s)) {
        result.x.col(s) = x.col(i);
        residual(s) = norm / norms(s);
        scales(s) = norm;
        if (norm > 0.0) {
          directions.col(s) = r / norm;
        }
      }
    }
    result.rounds = solved;
    const double before = worst;
    worst = select();
    if (solved > 0 && worst > kLeastProgress * before) {
      break;
    }
  }
  result.converged = active.empty();
  return result;
}

}  // namespace touchfield
