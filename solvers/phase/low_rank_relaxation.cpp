#include "solvers/phase/low_rank_relaxation.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Cholesky>
#include <cblas.h>

#include "solvers/linear/complex_product.h"
#include "solvers/phase/dual_factor.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr int kMostInnerSteps = 40;
constexpr double kInnerTolerance = 0.05;  // on the residual's share of the gradient
constexpr double kFaintestLevel = 1e-12;

double real_dot(const MatrixXcd& a, const MatrixXcd& b) { return (a.conjugate().array() * b.array()).real().sum(); }

VectorXd real_column_dots(const MatrixXcd& a, const MatrixXcd& b) {
  return (a.conjugate().array() * b.array()).real().colwise().sum();
}

/// Takes from each column of v its part along the column of y.
void project(const MatrixXcd& y, MatrixXcd& v) {
  const VectorXd along = real_column_dots(y, v);
  for (Index n = 0; n < v.cols(); ++n) {
    v.col(n) -= along(n) * y.col(n);
  }
}

double random_share(std::mt19937_64& generator) { return std::ldexp(static_cast<double>(generator() >> 11U), -53); }

VectorXcd random_column(Index size, std::mt19937_64& generator) {
  VectorXcd column(size);
  for (std::complex<double>& value : column) {
    const double angle = 2.0 * std::numbers::pi * random_share(generator);
    value = std::polar(std::sqrt(-std::log(1.0 - random_share(generator))), angle);
  }
  return column;
}

void evaluate(const LowRankRelaxation& relaxation, RelaxedPoint& point) {
  const Index levels = relaxation.level_count();
  multiply(point.y, relaxation.columns, point.sent);
  point.loudness = point.sent.leftCols(levels).colwise().norm();
  point.cost = (point.loudness - relaxation.levels).squaredNorm() +
               point.sent.rightCols(point.sent.cols() - levels).squaredNorm();
}

/// The flat gradient sends back (1 - b_j / g_j) a_j Y from the levels; a silent level has no direction to push in.
void differentiate(const LowRankRelaxation& relaxation, RelaxedPoint& point) {
  MatrixXcd weighted = point.sent;
  for (Index j = 0; j < relaxation.level_count(); ++j) {
    weighted.col(j) *= point.loudness(j) > 0 ? 1.0 - relaxation.levels(j) / point.loudness(j) : 0.0;
  }
  multiply_by_adjoint(weighted, relaxation.columns, point.gradient);
  point.d = real_column_dots(point.y, point.gradient);
  for (Index n = 0; n < point.y.cols(); ++n) {
    point.gradient.col(n) -= point.d(n) * point.y.col(n);
  }
}

/// Half the Hessian of F on the spheres at a point, its preconditioner, and the scratch space of both.
class NewtonSystem {
 public:
  NewtonSystem(const LowRankRelaxation& relaxation, const RelaxedPoint& point, DualFactor& factor)
      : relaxation_(relaxation),
        point_(point),
        factor_(factor),
        ratio_(relaxation.levels.cwiseQuotient(positive_loudness(relaxation, point))),
        directions_(point.sent.leftCols(relaxation.level_count())) {
    for (Index j = 0; j < directions_.cols(); ++j) {
      directions_.col(j) *= ratio_(j) / relaxation.levels(j);
    }
    prepare_radial_part();
  }

  /// hv = (Hess / 2) v.
  void apply(const MatrixXcd& v, MatrixXcd& hv) {
    multiply(v, relaxation_.columns, sent_);
    for (Index j = 0; j < relaxation_.level_count(); ++j) {
      const double radial = (directions_.col(j).conjugate().array() * sent_.col(j).array()).real().sum();
      sent_.col(j) = (1.0 - ratio_(j)) * sent_.col(j) + ratio_(j) * radial * directions_.col(j);
    }
    multiply_by_adjoint(sent_, relaxation_.columns, hv);
    for (Index n = 0; n < v.cols(); ++n) {
      hv.col(n) -= point_.d(n) * v.col(n);
    }
    project(point_.y, hv);
  }

  /// z = P (S + sigma + radial part)^-1 P r, by the Woodbury formula.
  void precondition(const MatrixXcd& r, MatrixXcd& z) {
    z = r;
    factor_.solve_in_place(z);
    const auto level_columns = relaxation_.columns.leftCols(relaxation_.level_count());
    multiply(z, level_columns, sent_);
    const VectorXd along = capacitance_.solve(real_column_dots(directions_, sent_));
    scaled_ = directions_ * along.asDiagonal();
    multiply(scaled_, responses_, back_);
    z -= back_;
    project(point_.y, z);
  }

 private:
  void prepare_radial_part() {
    responses_ = relaxation_.columns.leftCols(relaxation_.level_count()).adjoint();
    factor_.solve_in_place(responses_);
    MatrixXcd mutual;
    multiply(responses_, relaxation_.columns.leftCols(relaxation_.level_count()), mutual);
    MatrixXcd overlap;
    multiply(directions_.adjoint(), directions_, overlap);
    MatrixXd capacitance = (mutual.transpose().array() * overlap.array()).real();
    capacitance.diagonal() += ratio_.cwiseInverse();
    capacitance_.compute(capacitance);
  }

  const LowRankRelaxation& relaxation_;
  const RelaxedPoint& point_;
  DualFactor& factor_;
  VectorXd ratio_;        // b_j / g_j
  MatrixXcd directions_;  // a_j Y / g_j, l x K
  MatrixXcd responses_;   // (S + sigma)^-1 a_j^H as rows, K x N
  Eigen::LLT<MatrixXd> capacitance_;
  MatrixXcd sent_;
  MatrixXcd scaled_;
  MatrixXcd back_;
};

}  // namespace

VectorXd positive_loudness(const LowRankRelaxation& relaxation, const RelaxedPoint& point) {
  const VectorXd reach = relaxation.columns.leftCols(relaxation.level_count()).cwiseAbs().colwise().sum();
  return point.loudness.cwiseMax(kFaintestLevel * reach);
}

RelaxedPoint relaxed_start(const LowRankRelaxation& relaxation, Index width, unsigned seed) {
  std::mt19937_64 generator(seed);
  MatrixXcd wanted = MatrixXcd::Zero(width, relaxation.columns.cols());
  for (Index j = 0; j < relaxation.level_count(); ++j) {
    wanted.col(j) = relaxation.levels(j) * random_column(width, generator).normalized();
  }
  RelaxedPoint point;
  multiply_by_adjoint(wanted, relaxation.columns, point.y);
  for (Index n = 0; n < point.y.cols(); ++n) {
    const double length = point.y.col(n).norm();
    point.y.col(n) = length > 0 ? VectorXcd(point.y.col(n) / length) : random_column(width, generator).normalized();
  }
  evaluate(relaxation, point);
  differentiate(relaxation, point);
  return point;
}

VectorXd dual_weights(const LowRankRelaxation& relaxation, const VectorXd& g) {
  VectorXd weights = VectorXd::Ones(relaxation.columns.cols());
  weights.head(relaxation.level_count()).array() -= relaxation.levels.array() / g.array();
  return weights;
}

MatrixXcd dual_matrix(const LowRankRelaxation& relaxation, const VectorXd& g, const VectorXd& d) {
  const Index n = relaxation.channel_count();
  const Index m = relaxation.columns.cols();
  const VectorXd weights = dual_weights(relaxation, g);
  MatrixXcd matrix = MatrixXcd::Zero(n, n);
  MatrixXcd part(n, m);
  for (const double sign : {1.0, -1.0}) {
    Index count = 0;
    for (Index j = 0; j < m; ++j) {
      if (sign * weights(j) > 0) {
        part.col(count++) = std::sqrt(std::abs(weights(j))) * relaxation.columns.col(j);
      }
    }
    if (count > 0) {
      cblas_zherk(CblasColMajor, CblasLower, CblasNoTrans, static_cast<int>(n), static_cast<int>(count), sign,
                  part.data(), static_cast<int>(n), 1.0, matrix.data(), static_cast<int>(n));
    }
  }
  matrix.diagonal() -= d.cast<std::complex<double>>();
  return matrix;
}

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

  RelaxedPoint moved;
  moved.y = point.y + eta;
  moved.y.colwise().normalize();
  evaluate(relaxation, moved);
  differentiate(relaxation, moved);
  const double foretold = -2.0 * real_dot(point.gradient, eta) - real_dot(eta, curved);
  gain = foretold > 0 ? (point.cost - moved.cost) / foretold : std::numeric_limits<double>::quiet_NaN();
  return moved;
}

}  // namespace touchfield
