#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "solvers/phase/low_rank_relaxation.h"

namespace touchfield {

/// Whether S + shift is positive definite, and solves with it, for the dual matrix S of a relaxation,
///
///   S = A^H diag(s) A - diag(d),   s by dual_weights, complex conjugated as `columns` of the relaxation gives it.
///
/// `dense` forms the N x N matrix and takes its Cholesky factorisation. `reduced` works in the r dimensions that A
/// reaches: with columns = V T, V orthonormal, W = T diag(s) T^H, D = diag(shift - d) > 0 and V^H D^-1 V = L L^H,
///
///   S + shift > 0  if and only if  M = I + L^H W L > 0,
///   (S + shift)^-1 = D^-1 - P (I - M^-1) P^H,   P = D^-1 V L^-H.
///
/// It says no as well where shift <= max d, though S + shift may be definite there. What it says is true to working
/// precision and proves nothing.
class DualFactor {
 public:
  enum class Form : std::uint8_t { automatic, dense, reduced };

  /// automatic   reduced if the columns are fewer than half the channels. The relaxation must outlive this.
  explicit DualFactor(const LowRankRelaxation& relaxation, Form form = Form::automatic);

  /// Fixes the weights s by g (K, > 0).
  ///
  /// cost    dense 4 N^2 m operations, reduced none to speak of
  void weigh(const Eigen::VectorXd& g);

  /// False if S + shift is not positive definite; there is then nothing to solve with. After weigh.
  ///
  /// d       N
  /// cost    dense 4/3 N^3 operations, reduced 4 N r^2 and as much again at the first solve
  bool factorise(const Eigen::VectorXd& d, double shift);

  /// x <- x (S + shift)^-1, rows of x (any x N) being right-hand sides, after a factorise that succeeded.
  void solve_in_place(Eigen::MatrixXcd& x);

  bool is_reduced() const { return reduced_; }

 private:
  bool factorise_dense(const Eigen::VectorXd& d, double shift);
  bool factorise_reduced(const Eigen::VectorXd& d, double shift);
  void prepare_reduced_solve();

  const LowRankRelaxation& relaxation_;
  bool reduced_;
  Eigen::VectorXd weights_;     // s
  Eigen::MatrixXcd weighed_;    // A^H diag(s) A, lower triangle
  Eigen::MatrixXcd dense_;      // Cholesky factor of S + shift
  Eigen::MatrixXcd basis_;      // V, N x r
  Eigen::MatrixXcd core_;       // T, r x m
  Eigen::VectorXd inverse_;     // of D's diagonal
  Eigen::MatrixXcd reach_;      // L, lower triangle
  Eigen::MatrixXcd middle_;     // M's Cholesky factor, lower triangle; once prepared I - M^-1
  Eigen::MatrixXcd responses_;  // P
  bool prepared_ = false;       // of the reduced solve
  Eigen::MatrixXcd first_;      // scratch
  Eigen::MatrixXcd second_;
};

}  // namespace touchfield
