#pragma once

#include <Eigen/Core>

namespace touchfield {

class DualFactor;

/// The misfit of amplitudes with every drive replaced by a row of l numbers, of length one together: with Y the N x l
/// matrix of these rows,
///
///   F(Y) = sum_j (|a_j Y| - b_j)^2 + || T Y ||^2,   b_j > 0.
///
/// At l = 1 the rows are phasors and F is the misfit itself. At l > 1 its least value is no higher, and where l is not
/// too small every local minimum is the global one and proves a lower bound for l = 1.
struct LowRankRelaxation {
  Eigen::MatrixXcd columns;  // A^T, N x m: first the rows a_j, then those of T
  Eigen::VectorXd levels;    // b, K <= m, > 0

  Eigen::Index channel_count() const { return columns.rows(); }
  Eigen::Index level_count() const { return levels.size(); }
};

/// A point of the relaxation and what follows from it.
struct RelaxedPoint {
  Eigen::MatrixXcd y;         // Y^T, l x N, columns of length one
  Eigen::MatrixXcd sent;      // (A Y)^T, l x m
  Eigen::VectorXd loudness;   // g_j = |a_j Y|, K
  double cost = 0.0;          // F(Y)
  Eigen::MatrixXcd gradient;  // half of F's along the spheres, l x N
  Eigen::VectorXd d;          // N: Re of each row of half the gradient in the flat space along its row of Y
};

/// Random rows, sent back from random phases on the levels, with l = width: what looks like sound from the first step.
RelaxedPoint relaxed_start(const LowRankRelaxation& relaxation, Eigen::Index width, unsigned seed);

/// s, m: 1 - b_j / g_j on the levels, 1 on T.
Eigen::VectorXd dual_weights(const LowRankRelaxation& relaxation, const Eigen::VectorXd& g);

/// The matrix whose smallest eigenvalue is the proof,
///
///   S = A^H diag(s) A - diag(d),   s by dual_weights,
///
/// complex conjugated as the rows of `columns` give it; the lower triangle.
///
/// g        > 0
Eigen::MatrixXcd dual_matrix(const LowRankRelaxation& relaxation, const Eigen::VectorXd& g, const Eigen::VectorXd& d);

/// One step of Newton's method on the spheres, regularised by sigma and solved by conjugate gradients,
///
///   (Hess F / 2 + sigma) eta = -gradient,
///
/// preconditioned by the inverse of S + sigma with the part of the Hessian that acts along a_j Y added. S + sigma >= 0
/// makes the left-hand side definite.
///
/// factor    of dual_matrix + sigma
/// gain      (F - F_new) over what the model foretold; NaN where it foretold nothing
/// returns   the point stepped to, better or not
RelaxedPoint newton_step(const LowRankRelaxation& relaxation, const RelaxedPoint& point, DualFactor& factor,
                         double sigma, double& gain);

/// g_j, but no less than 1e-12 of the most that can reach the level: positive.
Eigen::VectorXd positive_loudness(const LowRankRelaxation& relaxation, const RelaxedPoint& point);

}  // namespace touchfield
