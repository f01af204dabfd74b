#pragma once

#include <Eigen/Core>

#include "solvers/phase/low_rank_relaxation.h"

namespace touchfield {

/// Whether S + shift is positive definite, and solves with it, for the dual matrix of a relaxation,
///
///   S = V W V^H - diag(d),   W = T diag(s) T^H + C,
///
/// complex conjugated as the relaxation's factors give it. In the r dimensions of V: with D = diag(shift - d) > 0,
/// V^H D^-1 V = L L^H and W as above,
///
///   S + shift > 0  if and only if  M = I + L^H W L > 0,
///   (S + shift)^-1 = D^-1 - D^-1 V L^-H (I - M^-1) L^-1 V^H D^-1,
///   (S + shift)^-1 V = D^-1 V L^-H M^-1 L^H.
///
/// At r = N, where V is square, the positive part of d moves from D into W. At r < N it says no as well where
/// shift <= max d, though S + shift may be definite there. What it says is true to working precision and proves
/// nothing.
class DualFactor {
 public:
  /// relaxation   outlives this
  explicit DualFactor(const LowRankRelaxation& relaxation) : relaxation_(relaxation) {}
  explicit DualFactor(const LowRankRelaxation&&) = delete;

  /// Fixes the weights s by g (K, > 0).
  void weigh(const Eigen::VectorXd& g);

  /// False if S + shift is not positive definite; there is then nothing to solve with. After weigh.
  ///
  /// d       N
  /// cost    4 N r^2 + 11 r^3 operations, 8 N^3 more at r = N where d > 0 somewhere
  bool factorise(const Eigen::VectorXd& d, double shift);

  /// Makes ready for what follows, after a factorise that succeeded.
  ///
  /// cost    16 r^3 + 16 r^2 K + 4 r K^2 operations
  void prepare();

  /// u = x D^-1 V, D without the positive part of d at r = N; rows of x (any x N) are right-hand sides.
  void reach(const Eigen::MatrixXcd& x, Eigen::MatrixXcd& u);

  /// z = x (S + shift)^-1 - back V^H D^-1, u = x D^-1 V, back of the size of u.
  void solve(const Eigen::MatrixXcd& x, const Eigen::MatrixXcd& u, const Eigen::MatrixXcd& back, Eigen::MatrixXcd& z);

  /// G, r x K, so that (S + shift)^-1 V T = D^-1 V G.
  const Eigen::MatrixXcd& level_responses() const { return level_responses_; }

  /// T^H V^H (S + shift)^-1 V T, K x K.
  const Eigen::MatrixXcd& mutual_responses() const { return mutual_responses_; }

 private:
  const LowRankRelaxation& relaxation_;
  Eigen::MatrixXcd weighed_;  // W
  Eigen::VectorXd inverse_;   // of D's diagonal
  Eigen::MatrixXcd reach_;    // L, lower triangle
  Eigen::MatrixXcd middle_;   // M's Cholesky factor, lower triangle; once prepared L^-H (I - M^-1) L^-1
  Eigen::MatrixXcd level_responses_;
  Eigen::MatrixXcd mutual_responses_;
  Eigen::MatrixXcd scratch_;
};

}  // namespace touchfield
