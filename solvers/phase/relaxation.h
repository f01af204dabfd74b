#pragma once

#include <Eigen/Core>

namespace touchfield {

/// The misfit of amplitudes with every drive replaced by a row of l numbers of length at most one: with Y the N x l
/// matrix of these rows,
///
///   F(Y) = sum_j (|a_j Y| - b_j)^2 + || R Y ||^2,   b_j > 0.
///
/// At l = 1 the rows are drives within the circle and F is the misfit itself. At l > 1 its least value is no higher.
/// Where l is not too small every local minimum is the global one and proves a lower bound for l = 1.
///
/// All of it happens in the r dimensions that the rows reach, or nearly do: A^T = V T, R^T conj(R) = V C V^H to a
/// tolerance.
struct LowRankRelaxation {
  Eigen::MatrixXcd basis;    // V, N x r, orthonormal columns
  Eigen::MatrixXcd levels;   // T, r x K
  Eigen::MatrixXcd outside;  // C, r x r
  Eigen::VectorXd wanted;    // b, K, > 0

  Eigen::Index channel_count() const { return basis.rows(); }
  Eigen::Index level_count() const { return wanted.size(); }
};

/// The relaxation of rows that are given as columns, N x m, the a_j first.
///
/// tolerance   on what the basis may leave out of them, ||E||_F / ||columns||_F; clipped to 1e-7..1
/// throws      std::domain_error on a value that is not finite
LowRankRelaxation relaxed(const Eigen::MatrixXcd& columns, const Eigen::VectorXd& wanted, double tolerance);

/// A point of the relaxation and what follows from it. Each row of Y has one number more, the slack, which makes its
/// length one and sounds nowhere. So the rows move on spheres.
struct RelaxedPoint {
  Eigen::MatrixXcd y;         // Y^T and the slack below it, (l + 1) x N, columns of length one
  Eigen::MatrixXcd sent;      // (A Y)^T and zeros, (l + 1) x K
  Eigen::VectorXd loudness;   // g_j = |a_j Y|, K
  double cost = 0.0;          // F(Y)
  Eigen::MatrixXcd gradient;  // half of F's along the spheres, (l + 1) x N
  Eigen::VectorXd d;          // N: Re of each row of half the gradient in the flat space along its row of Y
};

/// Sets the slack, the last row of x, to 0.
void take_slack(Eigen::MatrixXcd& x);

/// That of the rows Y^T with slack, (l + 1) x N, of length one.
RelaxedPoint relaxed_point(const LowRankRelaxation& relaxation, Eigen::MatrixXcd y);

/// A start, Y^T with slack: rows of the drives q (N) and of random numbers, of the lengths |q| within 0.05 to 0.98. The
/// random numbers of a row are 0.3 times as long as its phasor. The rows are near what q reaches already, and in no
/// corner that symmetry holds.
Eigen::MatrixXcd relaxed_start(const Eigen::VectorXcd& q, Eigen::Index width, unsigned seed);

/// s_j = 1 - b_j / g_j, the weights of the levels in the matrix whose smallest eigenvalue is the proof,
///
///   S = A^H diag(s) A + R^H R - diag(d).
Eigen::VectorXd level_weights(const Eigen::VectorXd& wanted, const Eigen::VectorXd& g);

/// g_j, but no less than 1e-12 (|a_j| + b_j): positive.
Eigen::VectorXd positive_loudness(const LowRankRelaxation& relaxation, const RelaxedPoint& point);
Eigen::VectorXd positive_loudness(const Eigen::VectorXd& g, const Eigen::VectorXd& lengths,
                                  const Eigen::VectorXd& wanted);

/// Re sum_ij conj(a_ij) b_ij, and the same of each column.
double real_dot(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);
Eigen::VectorXd real_column_dots(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

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

/// One step of Newton's method on the spheres, regularised by sigma and solved by conjugate gradients,
///
///   (Hess F / 2 + sigma) eta = -gradient,
///
/// preconditioned by the inverse of S + sigma with the part of the Hessian that acts along a_j Y added. S + sigma >= 0
/// makes the left-hand side definite.
///
/// factor    of S + sigma at the point's positive_loudness and d
/// gain      (F - F_new) over what the model foretold; NaN where it foretold nothing
/// returns   the point stepped to, better or not
RelaxedPoint newton_step(const LowRankRelaxation& relaxation, const RelaxedPoint& point, DualFactor& factor,
                         double sigma, double& gain);

}  // namespace touchfield
