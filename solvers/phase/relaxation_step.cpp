#include "solvers/phase/relaxation_step.h"

#include <limits>

#include <Eigen/Cholesky>

#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostInnerSteps = 40;
constexpr double kInnerTolerance = 0.2;  // on the residual's share of the gradient: less buys nothing

/// Takes from each column of v its part along the column of y.
void project(const MatrixXcd& y, MatrixXcd& v) {
  const VectorXd along = real_column_dots(y, v);
  for (Index n = 0; n < v.cols(); ++n) {
    v.col(n) -= along(n) * y.col(n);
  }
}

/// Half the Hessian of F on the spheres at a point, its preconditioner, and the scratch space of both.
class NewtonSystem {
 public:
  NewtonSystem(const LowRankRelaxation& relaxation, const RelaxedPoint& point, DualFactor& factor)
      : relaxation_(relaxation),
        point_(point),
        factor_(factor),
        ratio_(relaxation.wanted.cwiseQuotient(positive_loudness(relaxation, point))),
        directions_(point.sent) {
    for (Index j = 0; j < directions_.cols(); ++j) {
      directions_.col(j) *= ratio_(j) / relaxation.wanted(j);
    }
    factor_.prepare();
    MatrixXcd overlap;
    multiply(directions_.adjoint(), directions_, overlap);
    MatrixXd capacitance = (factor_.mutual_responses().transpose().array() * overlap.array()).real();
    capacitance.diagonal() += ratio_.cwiseInverse();
    capacitance_.compute(capacitance);
  }

  /// hv = (Hess / 2) v.
  void apply(const MatrixXcd& v, MatrixXcd& hv) {
    multiply(v, relaxation_.basis, reached_);
    take_slack(reached_);
    multiply(reached_, relaxation_.levels, sent_);
    for (Index j = 0; j < relaxation_.level_count(); ++j) {
      const double radial = (directions_.col(j).conjugate().array() * sent_.col(j).array()).real().sum();
      sent_.col(j) = (1.0 - ratio_(j)) * sent_.col(j) + ratio_(j) * radial * directions_.col(j);
    }
    multiply_by_adjoint(sent_, relaxation_.levels, back_);
    multiply(reached_, relaxation_.outside, outside_part_);
    back_ += outside_part_;
    multiply_by_adjoint(back_, relaxation_.basis, hv);
    for (Index n = 0; n < v.cols(); ++n) {
      hv.col(n) -= point_.d(n) * v.col(n);
    }
    project(point_.y, hv);
  }

  /// z = P (S + sigma + radial part)^-1 P r, by the Woodbury formula.
  void precondition(const MatrixXcd& r, MatrixXcd& z) {
    factor_.reach(r, reached_);
    take_slack(reached_);
    multiply(reached_, factor_.level_responses(), sent_);
    const VectorXd along = capacitance_.solve(real_column_dots(directions_, sent_));
    sent_ = directions_ * along.asDiagonal();
    multiply_by_adjoint(sent_, factor_.level_responses(), back_);
    factor_.solve(r, reached_, back_, z);
    project(point_.y, z);
  }

 private:
  const LowRankRelaxation& relaxation_;
  const RelaxedPoint& point_;
  DualFactor& factor_;
  VectorXd ratio_;        // b_j / g_j
  MatrixXcd directions_;  // a_j Y / g_j and zeros, (l + 1) x K
  Eigen::LLT<MatrixXd> capacitance_;
  MatrixXcd reached_;  // (l + 1) x r
  MatrixXcd outside_part_;
  MatrixXcd back_;
  MatrixXcd sent_;  // (l + 1) x K
};

}  // namespace

RelaxedPoint newton_step(const LowRankRelaxation& relaxation, const RelaxedPoint& point, DualFactor& factor,
                         double sigma, double& gain) {
  NewtonSystem system(relaxation, point, factor);
  MatrixXcd eta = MatrixXcd::Zero(point.y.rows(), point.y.cols());
  MatrixXcd curved = eta;  // Hess eta
  MatrixXcd residual = point.gradient;
  MatrixXcd z;
  MatrixXcd image;
  system.precondition(residual, z);
  MatrixXcd direction = -z;
  double product = real_dot(residual, z);
  const double target = kInnerTolerance * residual.norm();
  for (int i = 0; i < kMostInnerSteps && product > 0; ++i) {
    system.apply(direction, image);
    const double curvature = real_dot(direction, image) + sigma * direction.squaredNorm();
    if (!(curvature > 0)) {
      break;  // only rounding makes it so
    }
    const double length = product / curvature;
    eta += length * direction;
    curved += length * image;
    residual += length * (image + sigma * direction);
    if (residual.norm() <= target) {
      break;
    }
    system.precondition(residual, z);
    const double next = real_dot(residual, z);
    direction = (next / product) * direction - z;
    product = next;
  }

  RelaxedPoint moved = relaxed_point(relaxation, (point.y + eta).colwise().normalized());
  const double foretold = -2.0 * real_dot(point.gradient, eta) - real_dot(eta, curved);
  gain = foretold > 0 ? (point.cost - moved.cost) / foretold : std::numeric_limits<double>::quiet_NaN();
  return moved;
}

}  // namespace touchfield
