#pragma once

#include <complex>
#include <utility>
#include <vector>

#include "solvers/phase/skin_field.h"

namespace touchfield {

/// The residual of a SkinProblem and its Jacobian at one point, in real numbers:
///
///   f = [ sqrt(w_j) (|u_j| - p'_j);  Re t_1; Im t_1; Re t_2; ... ],   K + 2 r rows
///
/// against moves of the drives in their own frames, q_n -> e^{i phi_n} (a_n + s + i t): first the N tangential moves t,
/// then the radial moves s of the channels in `radial`. At a_n = 1 a tangential move is a turn of the phase.
class SkinJacobian {
 public:
  /// problem   outlives this object
  explicit SkinJacobian(const SkinProblem& problem);

  /// Moves the point. The channels in `radial` stay.
  ///
  /// field     of the drives there
  /// phasors   e^{i phi_n}
  void set(const SkinField& field, const Eigen::VectorXcd& phasors);

  /// radial   channels whose amplitude may move
  void set_radial(const std::vector<Eigen::Index>& radial);

  Eigen::Index rows() const { return residual_.size(); }
  Eigen::Index columns() const { return phasors_.size() + static_cast<Eigen::Index>(radial_.size()); }
  const Eigen::VectorXd& residual() const { return residual_; }

  /// y = J x.
  void apply(const Eigen::VectorXd& x, Eigen::VectorXd& y) const;

  /// x = J^T y.
  void apply_transpose(const Eigen::VectorXd& y, Eigen::VectorXd& x) const;

  /// inner = S J^T y and outer = J S inner in one pass over the matrix, S = diag(scale).
  void apply_gram(const Eigen::VectorXd& scale, const Eigen::VectorXd& y, Eigen::VectorXd& inner,
                  Eigen::VectorXd& outer) const;

  /// The complex drive-space gradient H_T^H v_T + R^H v_Z of the residual: J^T f is its part along each move.
  const Eigen::VectorXcd& drive_gradient() const { return drive_gradient_; }

  /// Its part along each move, columns().
  void gradient(Eigen::VectorXd& gradient) const { project(drive_gradient_, gradient); }

  /// The greatest diagonal entry of J J^T, from the rows' norms.
  double largest_row() const;

  /// J diag(scale), column by column.
  template <typename Real>
  void fill(const Eigen::VectorXd& scale, Real* matrix) const;

 private:
  /// The channel that a column moves and the change of its drive.
  std::pair<Eigen::Index, std::complex<double>> move_of(Eigen::Index column) const;
  void project(const Eigen::VectorXcd& x, Eigen::VectorXd& moves) const;
  void gather(const SkinField& field, Eigen::VectorXd& y) const;
  void spread(const Eigen::VectorXd& y, SkinField& field) const;

  const SkinProblem& problem_;
  Eigen::VectorXd reach_;
  Eigen::VectorXd root_weights_;
  Eigen::VectorXcd directions_;  // sqrt(w_j) u_j / |u_j|
  Eigen::VectorXcd phasors_;
  std::vector<Eigen::Index> radial_;
  std::vector<Eigen::Index> radial_column_;  // of each channel, -1 if its amplitude stays
  Eigen::VectorXd residual_;
  Eigen::VectorXcd drive_gradient_;
  mutable SkinField field_;  // of the moves, kept to spare allocations
  mutable Eigen::VectorXcd drives_;
  mutable std::vector<SkinField> shares_;  // of the threads
};

}  // namespace touchfield
