#include "solvers/phase/relaxation.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include <Eigen/Cholesky>
#include <cblas.h>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/factorisations.h"
#include "solvers/linear/low_rank.h"
#include "solvers/linear/random_share.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double kFaintestLevel = 1e-12;
constexpr double kStirred = 0.3;         // random rows against those of the start
constexpr double kShortest = 0.05;       // row of a start
constexpr double kLongest = 0.98;        // the rest is slack: without any a row could never become shorter
constexpr Index kCompressionBlock = 16;  // dimensions found at a time: each one too many costs

VectorXcd random_column(Index size, std::mt19937_64& generator) {
  VectorXcd column(size);
  for (std::complex<double>& value : column) {
    const double angle = 2.0 * std::numbers::pi * random_share(generator);
    value = std::polar(std::sqrt(-std::log(1.0 - random_share(generator))), angle);
  }
  return column;
}

enum class Side : bool { kLeft, kRight };

/// By cblas_ztrsm b <- op(L)^-1 b from the left or b op(L)^-1 from the right, by cblas_ztrmm the same with op(L); L
/// lower triangular.
template <class Blas>
void triangular(Blas blas, Side side, CBLAS_TRANSPOSE op, const MatrixXcd& l, MatrixXcd& b) {
  if (b.size() == 0) {
    return;  // which the BLAS refuses
  }
  const std::complex<double> one = 1.0;
  blas(CblasColMajor, side == Side::kLeft ? CblasLeft : CblasRight, CblasLower, op, CblasNonUnit,
       static_cast<int>(b.rows()), static_cast<int>(b.cols()), &one, l.data(), static_cast<int>(l.rows()), b.data(),
       static_cast<int>(b.rows()));
}

bool factorise_lower(MatrixXcd& matrix) { return cholesky_factorise(static_cast<int>(matrix.rows()), matrix.data()); }

using Eigen::MatrixXd;

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

double real_dot(const MatrixXcd& a, const MatrixXcd& b) { return (a.conjugate().array() * b.array()).real().sum(); }

VectorXd real_column_dots(const MatrixXcd& a, const MatrixXcd& b) {
  return (a.conjugate().array() * b.array()).real().colwise().sum();
}

LowRankRelaxation relaxed(const MatrixXcd& columns, const VectorXd& wanted, double tolerance) {
  LowRank reduced = compressed(columns, std::clamp(tolerance, 1e-7, 1.0), kCompressionBlock);
  LowRankRelaxation relaxation;
  relaxation.basis = std::move(reduced.basis);
  relaxation.levels = reduced.coefficients.leftCols(wanted.size());
  relaxation.outside = hermitian_product(reduced.coefficients.rightCols(columns.cols() - wanted.size()).adjoint());
  relaxation.wanted = wanted;
  return relaxation;
}

void take_slack(MatrixXcd& x) { x.bottomRows(1).setZero(); }

RelaxedPoint relaxed_point(const LowRankRelaxation& relaxation, MatrixXcd y) {
  RelaxedPoint point;
  point.y = std::move(y);
  MatrixXcd reached;
  MatrixXcd outside_part;
  multiply(point.y, relaxation.basis, reached);
  take_slack(reached);
  multiply(reached, relaxation.levels, point.sent);
  multiply(reached, relaxation.outside, outside_part);
  point.loudness = point.sent.colwise().norm();
  point.cost = (point.loudness - relaxation.wanted).squaredNorm() + real_dot(reached, outside_part);

  // The flat gradient sends back (1 - b_j / g_j) a_j Y from the levels; a silent level has no direction to push in.
  MatrixXcd weighted = point.sent;
  for (Index j = 0; j < relaxation.level_count(); ++j) {
    weighted.col(j) *= point.loudness(j) > 0 ? 1.0 - relaxation.wanted(j) / point.loudness(j) : 0.0;
  }
  MatrixXcd back;
  multiply_by_adjoint(weighted, relaxation.levels, back);
  back += outside_part;
  multiply_by_adjoint(back, relaxation.basis, point.gradient);
  point.d = real_column_dots(point.y, point.gradient);
  for (Index n = 0; n < point.y.cols(); ++n) {
    point.gradient.col(n) -= point.d(n) * point.y.col(n);
  }
  return point;
}

VectorXd positive_loudness(const LowRankRelaxation& relaxation, const RelaxedPoint& point) {
  return positive_loudness(point.loudness, relaxation.levels.colwise().norm(), relaxation.wanted);
}

VectorXd positive_loudness(const VectorXd& g, const VectorXd& lengths, const VectorXd& wanted) {
  return g.cwiseMax(kFaintestLevel * (lengths + wanted));
}

MatrixXcd relaxed_start(const VectorXcd& q, Index width, unsigned seed) {
  std::mt19937_64 generator(seed);
  MatrixXcd y(width + 1, q.size());
  for (Index n = 0; n < q.size(); ++n) {
    const double length = std::clamp(std::abs(q(n)), kShortest, kLongest);
    VectorXcd row = kStirred * random_column(width, generator).normalized();
    row(0) += std::polar(1.0, std::arg(q(n)));
    y.col(n) << length * row.normalized(), std::sqrt(1.0 - length * length);
  }
  return y;
}

VectorXd level_weights(const VectorXd& wanted, const VectorXd& g) { return 1.0 - wanted.array() / g.array(); }

void DualFactor::weigh(const VectorXd& g) {
  scratch_ = relaxation_.levels * level_weights(relaxation_.wanted, g).asDiagonal();
  multiply_by_adjoint(scratch_, relaxation_.levels, weighed_);
  weighed_ += relaxation_.outside;
}

bool DualFactor::factorise(const VectorXd& d, double shift) {
  const bool is_square = relaxation_.basis.rows() == relaxation_.basis.cols();
  const VectorXd diagonal = shift - (is_square ? d.cwiseMin(0.0) : d).array();
  if (!(diagonal.minCoeff() > 0) || !d.allFinite()) {
    return false;
  }
  inverse_ = diagonal.cwiseInverse();
  scratch_ = inverse_.cwiseSqrt().asDiagonal() * relaxation_.basis;
  reach_ = hermitian_product(scratch_);
  if (!factorise_lower(reach_)) {
    return false;
  }
  middle_ = weighed_;
  if (is_square && d.maxCoeff() > 0) {
    middle_ -= relaxation_.basis.adjoint() * d.cwiseMax(0.0).asDiagonal() * relaxation_.basis;
  }
  triangular(cblas_ztrmm, Side::kLeft, CblasConjTrans, reach_, middle_);
  triangular(cblas_ztrmm, Side::kRight, CblasNoTrans, reach_, middle_);
  middle_.diagonal().array() += 1.0;
  return factorise_lower(middle_);
}

void DualFactor::prepare() {
  level_responses_ = relaxation_.levels;
  triangular(cblas_ztrmm, Side::kLeft, CblasConjTrans, reach_, level_responses_);
  triangular(cblas_ztrsm, Side::kLeft, CblasNoTrans, middle_, level_responses_);
  mutual_responses_ = hermitian_product(level_responses_);
  triangular(cblas_ztrsm, Side::kLeft, CblasConjTrans, middle_, level_responses_);
  triangular(cblas_ztrsm, Side::kLeft, CblasConjTrans, reach_, level_responses_);

  const Index rank = reach_.rows();
  scratch_ = MatrixXcd::Identity(rank, rank);
  triangular(cblas_ztrsm, Side::kLeft, CblasNoTrans, middle_, scratch_);
  triangular(cblas_ztrsm, Side::kLeft, CblasConjTrans, middle_, scratch_);
  middle_ = MatrixXcd::Identity(rank, rank) - scratch_;
  triangular(cblas_ztrsm, Side::kLeft, CblasConjTrans, reach_, middle_);
  triangular(cblas_ztrsm, Side::kRight, CblasNoTrans, reach_, middle_);
}

void DualFactor::reach(const MatrixXcd& x, MatrixXcd& u) {
  scratch_ = x * inverse_.asDiagonal();
  multiply(scratch_, relaxation_.basis, u);
}

void DualFactor::solve(const MatrixXcd& x, const MatrixXcd& u, const MatrixXcd& back, MatrixXcd& z) {
  multiply(u, middle_, scratch_);
  scratch_ += back;
  multiply_by_adjoint(scratch_, relaxation_.basis, z);
  z = (x - z) * inverse_.asDiagonal();
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

  RelaxedPoint moved = relaxed_point(relaxation, (point.y + eta).colwise().normalized());
  const double foretold = -2.0 * real_dot(point.gradient, eta) - real_dot(eta, curved);
  gain = foretold > 0 ? (point.cost - moved.cost) / foretold : std::numeric_limits<double>::quiet_NaN();
  return moved;
}

}  // namespace touchfield
