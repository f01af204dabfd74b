#include "solvers/phase/dual_factor.h"

#include <cmath>
#include <complex>

#include <Eigen/QR>
#include <cblas.h>

#include "solvers/linear/cholesky.h"
#include "solvers/linear/complex_product.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;

constexpr double kNumericalRank = 1e-13;  // of the columns, relative to the longest

/// b <- b op(L)^-1, or op(L)^-1 b from the left; L lower triangular.
void solve_triangular(CBLAS_SIDE side, CBLAS_TRANSPOSE transpose, const MatrixXcd& l, MatrixXcd& b) {
  if (b.size() == 0) {
    return;  // which the BLAS refuses
  }
  const std::complex<double> one = 1.0;
  cblas_ztrsm(CblasColMajor, side, CblasLower, transpose, CblasNonUnit, static_cast<int>(b.rows()),
              static_cast<int>(b.cols()), &one, l.data(), static_cast<int>(l.rows()), b.data(),
              static_cast<int>(b.rows()));
}

/// b <- L^H b.
void apply_adjoint(const MatrixXcd& l, MatrixXcd& b) {
  const std::complex<double> one = 1.0;
  cblas_ztrmm(CblasColMajor, CblasLeft, CblasLower, CblasConjTrans, CblasNonUnit, static_cast<int>(b.rows()),
              static_cast<int>(b.cols()), &one, l.data(), static_cast<int>(l.rows()), b.data(),
              static_cast<int>(b.rows()));
}

bool factorise_lower(MatrixXcd& matrix) { return cholesky_factorise(static_cast<int>(matrix.rows()), matrix.data()); }

}  // namespace

DualFactor::DualFactor(const LowRankRelaxation& relaxation, Form form)
    : relaxation_(relaxation),
      reduced_(form == Form::reduced ||
               (form == Form::automatic && 2 * relaxation.columns.cols() < relaxation.channel_count())) {
  if (!reduced_) {
    return;
  }
  Eigen::ColPivHouseholderQR<MatrixXcd> qr(relaxation.columns);
  qr.setThreshold(kNumericalRank);
  const Index rank = qr.rank();
  basis_ = qr.householderQ() * MatrixXcd::Identity(relaxation.channel_count(), rank);
  core_ = MatrixXcd(qr.matrixR().topRows(rank).triangularView<Eigen::Upper>()) * qr.colsPermutation().transpose();
}

void DualFactor::weigh(const VectorXd& g) {
  if (reduced_) {
    weights_ = dual_weights(relaxation_, g);
  } else {
    weighed_ = dual_matrix(relaxation_, g, VectorXd::Zero(relaxation_.channel_count()));
  }
}

bool DualFactor::factorise(const VectorXd& d, double shift) {
  return reduced_ ? factorise_reduced(d, shift) : factorise_dense(d, shift);
}

bool DualFactor::factorise_dense(const VectorXd& d, double shift) {
  dense_ = weighed_;
  dense_.diagonal().array() += shift - d.array();
  return factorise_lower(dense_);
}

bool DualFactor::factorise_reduced(const VectorXd& d, double shift) {
  prepared_ = false;
  const VectorXd diagonal = shift - d.array();
  if (!(diagonal.minCoeff() > 0)) {
    return false;
  }
  inverse_ = diagonal.cwiseInverse();
  const Index rank = basis_.cols();
  if (rank == 0) {
    return true;  // D is all there is, and the BLAS refuses what is empty
  }
  first_ = inverse_.cwiseSqrt().asDiagonal() * basis_;
  reach_ = MatrixXcd::Zero(rank, rank);
  cblas_zherk(CblasColMajor, CblasLower, CblasConjTrans, static_cast<int>(rank), static_cast<int>(first_.rows()), 1.0,
              first_.data(), static_cast<int>(first_.rows()), 0.0, reach_.data(), static_cast<int>(rank));
  if (!factorise_lower(reach_)) {
    return false;
  }
  first_ = core_;
  apply_adjoint(reach_, first_);
  second_ = first_ * weights_.asDiagonal();
  multiply_by_adjoint(second_, first_, middle_);
  middle_.diagonal().array() += 1.0;
  return factorise_lower(middle_);
}

void DualFactor::prepare_reduced_solve() {
  const Index rank = basis_.cols();
  responses_ = inverse_.asDiagonal() * basis_;
  solve_triangular(CblasRight, CblasConjTrans, reach_, responses_);
  first_ = MatrixXcd::Identity(rank, rank);
  solve_triangular(CblasLeft, CblasNoTrans, middle_, first_);
  solve_triangular(CblasLeft, CblasConjTrans, middle_, first_);
  middle_ = MatrixXcd::Identity(rank, rank) - first_;
  prepared_ = true;
}

void DualFactor::solve_in_place(MatrixXcd& x) {
  if (!reduced_) {
    solve_triangular(CblasRight, CblasConjTrans, dense_, x);
    solve_triangular(CblasRight, CblasNoTrans, dense_, x);
    return;
  }
  if (basis_.cols() == 0) {
    x = x * inverse_.asDiagonal();
    return;
  }
  if (!prepared_) {
    prepare_reduced_solve();
  }
  multiply(x, responses_, first_);
  multiply(first_, middle_, second_);
  multiply_by_adjoint(second_, responses_, first_);
  x = x * inverse_.asDiagonal();
  x -= first_;
}

}  // namespace touchfield
