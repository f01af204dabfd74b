#pragma once

#include <vector>

#include "solvers/phase/skin_jacobian.h"

namespace touchfield {

/// Solves (J^T J + diag(d)) h = -(J^T f + e) on the smaller side, e the gradient of the rows that are left out of f and
/// J. With S = diag(d)^-1/2, L = J S:
///
///   rows <= columns:  h = -S [L^T (L L^T + I)^-1 (f - L S e) + S e];   else  h = -S (L^T L + I)^-1 S (J^T f + e)
///
/// The matrix is formed and factorised in single precision, and the solution is refined against J in double. Where that
/// does not converge (d far below eps ||J||^2 of single precision), both happen in double.
///
/// Where the problem has a device, the device forms the matrix, factorises and corrects, always as for rows <= columns.
/// The number of corrections is decided here.
///
/// accuracy   residual of the inner system below 1e-8 of its right-hand side
class DampedStep {
 public:
  /// d   columns() values > 0
  /// returns   false where the matrix is singular to working precision, h then holds nothing of use
  bool solve(const SkinJacobian& jacobian, const Eigen::VectorXd& d, Eigen::VectorXd& h);

  /// h = -(J^T J + diag(d))^-1 J^T y by the factor of the last call of solve, which was true; y of rows() entries.
  /// returns   false where it does not converge
  bool solve_again(const SkinJacobian& jacobian, const Eigen::VectorXd& y, Eigen::VectorXd& h);

  /// How many of the calls needed double precision.
  int double_count() const { return double_count_; }

 private:
  template <typename Real>
  struct Factor {
    std::vector<Real> scaled;  // L
    std::vector<Real> matrix;  // its Cholesky factor in the lower triangle
    std::vector<Real> right;
  };

  template <typename Real>
  bool factorise(const SkinJacobian& jacobian, Factor<Real>& factor);
  template <typename Real>
  bool refine(const SkinJacobian& jacobian, Factor<Real>& factor, Eigen::VectorXd& h);
  template <typename Real>
  double correct(const SkinJacobian& jacobian, Factor<Real>& factor, double unit);
  void prepare(const SkinJacobian& jacobian);
  void apply(const SkinJacobian& jacobian, const Eigen::VectorXd& y);

  bool by_rows_ = true;
  bool in_double_ = false;  // the last factor
  Eigen::VectorXd scale_;   // the diagonal of S
  Factor<float> single_;
  Factor<double> double_;
  int double_count_ = 0;
  Eigen::VectorXd right_;
  Eigen::VectorXd apart_;  // S S e, of no size if no rows are left out
  Eigen::VectorXd solution_;
  Eigen::VectorXd remainder_;
  Eigen::VectorXd scaled_;
  Eigen::VectorXd inner_;  // S J^T y by rows, J S y by columns
  Eigen::VectorXd outer_;  // L L^T y or L^T L y
};

}  // namespace touchfield
