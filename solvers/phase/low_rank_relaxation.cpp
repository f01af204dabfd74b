#include "solvers/phase/low_rank_relaxation.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <utility>

#include "solvers/linear/blas_product.h"
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

RelaxedPoint relaxed_start(const LowRankRelaxation& relaxation, const VectorXcd& q, Index width, unsigned seed) {
  std::mt19937_64 generator(seed);
  MatrixXcd y(width + 1, q.size());
  for (Index n = 0; n < q.size(); ++n) {
    const double length = std::clamp(std::abs(q(n)), kShortest, kLongest);
    VectorXcd row = kStirred * random_column(width, generator).normalized();
    row(0) += std::polar(1.0, std::arg(q(n)));
    y.col(n) << length * row.normalized(), std::sqrt(1.0 - length * length);
  }
  return relaxed_point(relaxation, std::move(y));
}

VectorXd level_weights(const VectorXd& wanted, const VectorXd& g) { return 1.0 - wanted.array() / g.array(); }

}  // namespace touchfield
