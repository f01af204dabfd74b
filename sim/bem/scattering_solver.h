#pragma once

#include <functional>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "sim/bem/scattering_system.h"
#include "solvers/linear/factorisations.h"

namespace touchfield {

struct SolveReport {
  int steps = 0;        // most GMRES steps of a column, all refinements together; 0 of LU
  int refinements = 0;  // corrections after the first solution
  /// Worst relative residual of a column, by a product in double. With a tolerance of 9e-5 or more, GMRES in single
  /// precision takes the residual by its own products plus their rounding, 3e-6. With a tolerance of 5 times the grid's
  /// error or more, GMRES through a grid takes it by those products plus this error. Of more than 8 columns only 8 are
  /// examined, if they are solved by LU or not refined.
  double residual = 0;
  bool converged = false;   // residual <= tolerance
  bool two_level = false;   // whether the preconditioner was in use at the end
  std::string set_aside{};  // why it was not though the options ask for it
};

struct Solved {
  Eigen::MatrixXcd x;  // unknowns x S
  SolveReport report;
};

/// Solves B p = b for many right-hand sides at once.
class ScatteringSolver {
 public:
  /// step, worst residual of the columns so far
  using Report = std::function<void(int, double)>;

  ScatteringSolver() = default;
  ScatteringSolver(const ScatteringSolver&) = delete;
  ScatteringSolver& operator=(const ScatteringSolver&) = delete;
  virtual ~ScatteringSolver() = default;

  /// B^-1 b, unknowns x S. Not reaching the tolerance is said in the report.
  /// throws   NumericalError if a value is not finite
  virtual Solved solve(const Eigen::MatrixXcd& b, const Report& report = {}) const = 0;
  /// B^-T b, without conjugation.
  virtual Solved solve_transpose(const Eigen::MatrixXcd& b, const Report& report = {}) const = 0;
  /// Estimate of the reciprocal condition number of B in the 1-norm; NaN where none is made.
  virtual double reciprocal_condition() const = 0;
  virtual const SolverOptions& options() const = 0;
};

/// system   outlives the solver
/// throws   NumericalError if B is singular or holds a value that is not finite
std::unique_ptr<ScatteringSolver> make_solver(const ScatteringSystem& system, const SolverOptions& options);
std::unique_ptr<ScatteringSolver> make_solver(const ScatteringSystem&&, const SolverOptions&) = delete;

/// Memory that a solver holds beside its system, for S right-hand sides at once [bytes].
double solver_memory(Eigen::Index unknowns, const SolverOptions& options, Eigen::Index right_hand_sides);

/// The transfer matrix H of a body, p = H q, M x N [Pa], never formed: B^-1 by its LU factors, b and B_c stored, all in
/// single precision,
///
///   H = B^-1 b,   of burton_miller_polished   H = (1 - B_c)^2 B^-1 b + (2 - B_c) e
///
/// For a few products with one vector at a time, which cost 8 M (M + N) operations each, twice that if polished,
/// against 8 M^2 N for H itself.
///
/// accuracy   1e-4 of the largest pressure, where B is well conditioned: that of incident_matrix_single
class FactoredTransfer {
 public:
  /// Factorises B.
  /// throws   std::domain_error if B is singular or holds a value that is not finite
  explicit FactoredTransfer(const ScatteringSystem& system);

  /// Where the array is to the body; to be called before a product.
  ///
  /// system   the one that was factorised, or one with the same vertices
  void face(const ScatteringSystem& system, const TransducerArray& array);

  /// H q, M.
  Eigen::VectorXcf pressure(const Eigen::VectorXcf& q) const;

  /// H^H v, N.
  Eigen::VectorXcf sent_back(const Eigen::VectorXcf& v) const;

 private:
  Eigen::Index faces_;
  DenseLuSingle lu_;
  Eigen::MatrixXcf polisher_;  // 1 - B_c, empty where nothing is polished
  Eigen::MatrixXcf interior_;  // C of chief, likewise
  Eigen::MatrixXcf b_;         // of chief e above e_z
  Eigen::MatrixXcf incident_;  // e, empty where nothing is polished
};

}  // namespace touchfield
