#pragma once

#include <complex>
#include <utility>
#include <vector>

#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// The residual of a SkinProblem and its Jacobian at one point, in real numbers:
///
///   f = [ sqrt(w_j) (|u_j| - p'_j);  Re t_1; Im t_1; Re t_2; ... ],   K + 2 r rows
///
/// or the first of them. Rows at the end that are too weak to matter in a linear model can be left out of f and J,
/// though not of the gradient.
///
/// The Jacobian is against moves of the drives in their own frames, q_n -> e^{i phi_n} (a_n + s + i t). First come the
/// N tangential moves t, then the radial moves s of the channels in `radial`. At a_n = 1 a tangential move is a turn of
/// the phase.
class SkinJacobian {
 public:
  /// problem   outlives this object
  explicit SkinJacobian(const SkinProblem& problem);
  explicit SkinJacobian(const SkinProblem&&) = delete;

  /// Moves the point. The channels in `radial` stay.
  ///
  /// field     of the drives there
  /// phasors   e^{i phi_n}
  void set(const SkinField& field, const Eigen::VectorXcd& phasors);

  /// Leaves rows at the end of R out of f and J until it is called again, as many as J^T J can lack for a norm below
  /// `most`. If R's rows are orthogonal, which the constructor finds out, those are left out that have squared norms
  /// below it. Else those are left out that have a sum of squared norms below it.
  void leave_out_up_to(double most);

  /// radial   channels whose amplitude may move
  void set_radial(const std::vector<Eigen::Index>& radial);

  Eigen::Index rows() const { return problem_.target_count() + 2 * kept_; }
  Eigen::Index columns() const { return phasors_.size() + static_cast<Eigen::Index>(radial_.size()); }
  auto residual() const { return residual_.head(rows()); }

  /// y = J x.
  void apply(const Eigen::VectorXd& x, Eigen::VectorXd& y) const;

  /// The residual's second derivative along phi + s turns at s = 0, with the amplitudes as they are:
  ///
  ///   sqrt(w_j) (Re(conj(e_j) u''_j) + Im(conj(e_j) u'_j)^2 / |u_j|);  Re, Im of t'',   u' = H i (turns .* q),
  ///   u'' = -H (turns^2 .* q)
  ///
  /// e_j the pressure's direction. Where |u_j| < p'_j / 4 that stands in for |u_j|: closer to silence the parabola
  /// holds for no step of use.
  ///
  /// turns   N [rad]
  void second_derivative(const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& turns, Eigen::VectorXd& y) const;

  /// x = J^T y.
  void apply_transpose(const Eigen::VectorXd& y, Eigen::VectorXd& x) const;

  /// inner = S J^T y and outer = J S inner in one pass over the matrix, S = diag(scale).
  void apply_gram(const Eigen::VectorXd& scale, const Eigen::VectorXd& y, Eigen::VectorXd& inner,
                  Eigen::VectorXd& outer) const;

  /// The complex drive-space gradient H_T^H v_T + R^H v_Z of the residual, all rows of R counted: its part along each
  /// move is J^T f with no row left out.
  const Eigen::VectorXcd& drive_gradient() const { return drive_gradient_; }

  /// Its part along each move, columns().
  void gradient(Eigen::VectorXd& gradient) const { project(drive_gradient_, gradient); }

  /// The part along each move that the rows left out have in the gradient. False, and nothing done, if there are none.
  bool gradient_left_out(Eigen::VectorXd& gradient) const;

  /// The greatest diagonal entry of J J^T, from the norms of all rows.
  double largest_row() const;

  /// J diag(scale), column by column.
  template <typename Real>
  void fill(const Eigen::VectorXd& scale, Real* matrix) const;

  /// The problem's device, null if it has none, and what that needs to form J; valid until the point or the moves
  /// change.
  SkinDevice* device() const { return problem_.device.get(); }
  SkinMoves moves() const;

 private:
  /// The channel that a column moves and the change of its drive.
  std::pair<Eigen::Index, std::complex<double>> move_of(Eigen::Index column) const;
  void project(const Eigen::VectorXcd& x, Eigen::VectorXd& moves) const;
  void gather(const SkinField& field, Eigen::VectorXd& y) const;
  void spread(const Eigen::VectorXd& y, SkinField& field) const;

  const SkinProblem& problem_;
  Eigen::VectorXd strengths_;  // squared norms of R's rows
  bool orthogonal_;            // R's rows
  Eigen::Index kept_;          // rows of R in f and J
  Eigen::VectorXd reach_;
  Eigen::VectorXd root_weights_;
  Eigen::VectorXcd directions_;  // sqrt(w_j) u_j / |u_j|
  Eigen::VectorXcd phasors_;
  std::vector<Eigen::Index> radial_;
  std::vector<Eigen::Index> radial_column_;  // of each channel, -1 if its amplitude stays
  Eigen::VectorXd residual_;                 // with all rows of R
  Eigen::VectorXcd drive_gradient_;
  mutable SkinField field_;  // of the moves, kept to spare allocations
  mutable Eigen::VectorXcd drives_;
  mutable std::vector<SkinField> shares_;  // of the threads
};

/// dC/d Re q + i dC/d Im q of C = skin_cost at drives q, N. Where a face of the target is silent: a subgradient, by
/// pressure_directions.
Eigen::VectorXcd skin_gradient(const SkinProblem& problem, const Eigen::VectorXcd& q);

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
