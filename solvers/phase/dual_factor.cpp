#include "solvers/phase/dual_factor.h"

#include <complex>

#include <cblas.h>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/cholesky.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;

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

}  // namespace

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

}  // namespace touchfield
