#pragma once

#include <memory>
#include <optional>

#include "sim/bem/scattering_system.h"
#include "sim/core/progress.h"
#include "sim/run/model.h"
#include "solvers/phase/phase_solution.h"

namespace touchfield {

/// Solves the phase methods of a scene on one scattering system. What several methods share (G, G^H G, the factors of
/// B) is computed once, when the first one needs it.
class MethodSolver {
 public:
  /// target   absent for scenes without one; methods other than `fixed` need one. All arguments outlive the solver.
  MethodSolver(const ScatteringSystem& system, const ScatteringSolver& solver, const TransducerArray& array,
               const std::optional<Target>& target);

  /// The drives a method finds for wanted amplitudes p' on the target's faces, K [Pa] (empty without a target).
  /// throws   NumericalError if a matrix of the problem is not finite
  PhaseSolution solve(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress);

  /// The pressure on the skin that drives cause, p = B^-1 G q, M.
  Eigen::VectorXcd scattered_pressure(const PhaseSolution& solution) const;

  /// The factor on the target's amplitudes for a scene that asks for the best pressure: the one at which `method`
  /// reaches the lowest relative error of |p| after its own best scale. A method that iterates is solved again at each
  /// trial of a golden-section search over 1/50 to 1 of the largest pressure the array can make on the target's central
  /// face; the others do not depend on the scale and get the one at which they fit best.
  double best_scale(const MethodSpec& method, const Wave& wave, const std::vector<TargetBox>& boxes,
                    Progress& progress);

  const Eigen::MatrixXcd& incident() const { return g_; }

 private:
  PhaseSolution solve_incident_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress);
  Eigen::RowVectorXcd central_row() const;

  const ScatteringSystem& system_;
  const ScatteringSolver& solver_;
  const std::optional<Target>& target_;
  Eigen::MatrixXcd g_;
  Eigen::MatrixXcd gram_g_;   // empty until needed
  Eigen::MatrixXcd columns_;  // B_T, likewise
};

}  // namespace touchfield
