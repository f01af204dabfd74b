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

/// A start: rows of the drives q (N) and of random numbers, of the lengths |q| within 0.05 to 0.98. The random
/// numbers of a row are 0.3 times as long as its phasor. The rows are near what q reaches already, and in no corner
/// that symmetry holds.
RelaxedPoint relaxed_start(const LowRankRelaxation& relaxation, const Eigen::VectorXcd& q, Eigen::Index width,
                           unsigned seed);

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

}  // namespace touchfield
