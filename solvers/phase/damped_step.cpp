#include "solvers/phase/damped_step.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include <cblas.h>

#include "solvers/linear/cholesky.h"

namespace touchfield {

namespace {

constexpr double kAccuracy = 1e-8;  // what the number of threads changes in single precision stays below it
constexpr double kSlowest = 0.2;    // a correction that leaves more of the residual is not worth its two products
constexpr int kCorrections = 12;    // at that rate these reach 4e-9

constexpr auto rank_update(float /*precision*/) { return cblas_ssyrk; }
constexpr auto rank_update(double /*precision*/) { return cblas_dsyrk; }

/// Grows but never shrinks, so that a changing number of columns allocates only at its peak.
template <typename Real>
void reserve(std::vector<Real>& buffer, Eigen::Index size) {
  buffer.resize(std::max(buffer.size(), static_cast<std::size_t>(size)));
}

}  // namespace

bool DampedStep::solve(const SkinJacobian& jacobian, const Eigen::VectorXd& d, Eigen::VectorXd& h) {
  scale_ = d.array().rsqrt();
  prepare(jacobian);
  in_double_ = false;
  if (factorise(jacobian, single_) && refine(jacobian, single_, h)) {
    return true;
  }
  ++double_count_;
  in_double_ = true;
  return factorise(jacobian, double_) && refine(jacobian, double_, h);
}

bool DampedStep::solve_again(const SkinJacobian& jacobian, const Eigen::VectorXd& y, Eigen::VectorXd& h) {
  apart_.resize(0);
  if (by_rows_) {
    right_ = y;
  } else {
    jacobian.apply_transpose(y, right_);
    right_.array() *= scale_.array();
  }
  return in_double_ ? refine(jacobian, double_, h) : refine(jacobian, single_, h);
}

/// Chooses the side and sets the right-hand side.
void DampedStep::prepare(const SkinJacobian& jacobian) {
  by_rows_ = jacobian.device() != nullptr || jacobian.rows() <= jacobian.columns();
  apart_.resize(0);
  if (!by_rows_) {
    jacobian.gradient(right_);
    right_.array() *= scale_.array();
    return;
  }
  right_ = jacobian.residual();
  if (jacobian.gradient_left_out(apart_)) {
    apart_.array() *= scale_.array().square();
    jacobian.apply(apart_, outer_);
    right_ -= outer_;
  }
}

template <typename Real>
bool DampedStep::factorise(const SkinJacobian& jacobian, Factor<Real>& factor) {
  if (jacobian.device() != nullptr) {
    return jacobian.device()->factorise(jacobian.moves(), scale_.data(), std::is_same_v<Real, double>);
  }
  const int rows = static_cast<int>(jacobian.rows());
  const int columns = static_cast<int>(jacobian.columns());
  const int size = std::min(rows, columns);
  reserve(factor.scaled, jacobian.rows() * jacobian.columns());
  reserve(factor.matrix, Eigen::Index{size} * size);
  reserve(factor.right, size);
  jacobian.fill(scale_, factor.scaled.data());
  const Real one = 1;
  const Real zero = 0;
  rank_update(Real{})(CblasColMajor, CblasLower, by_rows_ ? CblasNoTrans : CblasTrans, size, std::max(rows, columns),
                      one, factor.scaled.data(), rows, zero, factor.matrix.data(), size);
  for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
    factor.matrix[i * static_cast<std::size_t>(size + 1)] += one;
  }
  return cholesky_factorise(size, factor.matrix.data());
}

template <typename Real>
bool DampedStep::refine(const SkinJacobian& jacobian, Factor<Real>& factor, Eigen::VectorXd& h) {
  SkinDevice* device = jacobian.device();
  double before = right_.norm();
  const double target = kAccuracy * before;
  if (device == nullptr) {
    remainder_ = right_;
    solution_ = Eigen::VectorXd::Zero(right_.size());
  }
  inner_.resize(jacobian.columns());
  for (int correction = 0; correction < kCorrections; ++correction) {
    // Normalised, so that single precision holds a right-hand side of any unit.
    const double unit = before > 0 ? before : 1.0;
    const double after = device != nullptr
                             ? device->correct(correction == 0 ? right_.data() : nullptr, unit, inner_.data())
                             : correct(jacobian, factor, unit);
    if (after <= target) {
      h = -scale_.array() * (by_rows_ ? inner_ : solution_).array();
      if (by_rows_ && apart_.size() > 0) {
        h -= apart_;
      }
      return true;
    }
    if (!(after <= kSlowest * before)) {
      return false;
    }
    before = after;
  }
  return false;
}

/// As SkinDevice::correct says.
template <typename Real>
double DampedStep::correct(const SkinJacobian& jacobian, Factor<Real>& factor, double unit) {
  const int size = static_cast<int>(right_.size());
  for (int i = 0; i < size; ++i) {
    factor.right[static_cast<std::size_t>(i)] = static_cast<Real>(remainder_(i) / unit);
  }
  cholesky_solve(size, factor.matrix.data(), factor.right.data());
  for (int i = 0; i < size; ++i) {
    solution_(i) += unit * static_cast<double>(factor.right[static_cast<std::size_t>(i)]);
  }
  apply(jacobian, solution_);
  remainder_ = right_ - solution_ - outer_;
  return remainder_.norm();
}

/// inner = S J^T y and outer = J S inner by rows; inner = J S y and outer = S J^T inner by columns.
void DampedStep::apply(const SkinJacobian& jacobian, const Eigen::VectorXd& y) {
  if (by_rows_) {
    jacobian.apply_gram(scale_, y, inner_, outer_);
  } else {
    scaled_ = scale_.array() * y.array();
    jacobian.apply(scaled_, inner_);
    jacobian.apply_transpose(inner_, outer_);
    outer_.array() *= scale_.array();
  }
}

}  // namespace touchfield
