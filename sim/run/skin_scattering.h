#pragma once

#include <memory>
#include <optional>

#include "sim/acoustics/transducer_array.h"
#include "sim/core/progress.h"
#include "sim/output/run_data.h"
#include "sim/run/solver_choice.h"

namespace touchfield {

/// One body in one scheme with its solver and an array: what turns drives into pressures on the skin. The solver is
/// made when the first solution is asked for, the field of every channel when a method needs it. Solves are recorded.
class SkinScattering {
 public:
  /// records            gets a line a solve; array, records and progress outlive this
  /// right_hand_sides   of the largest block that will be asked for: what the solver is chosen by
  SkinScattering(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec,
                 const TransducerArray& array, std::vector<SolveRecord>& records, Progress& progress,
                 Eigen::Index right_hand_sides = 1);

  const ScatteringSystem& system() const { return system_; }
  const SolverDecision& decision() const { return decision_; }

  /// The field of every channel at unit drive; kept once made.
  const IncidentField& unit_field();

  /// Pressures M x S [Pa] of drives N x S.
  ///
  /// stage    what the record calls it
  Eigen::MatrixXcd pressure(const Eigen::MatrixXcd& drives, const std::string& stage);

  /// Rows of H of the given faces, K x N [Pa]: the pressure of every channel there.
  Eigen::MatrixXcd transfer_rows(const std::vector<Eigen::Index>& faces, const std::string& stage);

  /// Reciprocal condition number of B; NaN if no factorisation has been made.
  double reciprocal_condition() const;

 private:
  const ScatteringSolver& solver();
  void record(const std::string& stage, const Eigen::MatrixXcd& b, const SolveReport& report, double seconds);
  IncidentField driven_field(const Eigen::MatrixXcd& drives);
  ScatteringSolver::Report reporter();

  ScatteringSystem system_;
  SolverDecision decision_;
  const TransducerArray& array_;
  std::vector<SolveRecord>& records_;
  Progress& progress_;
  std::unique_ptr<ScatteringSolver> solver_;
  std::optional<IncidentField> unit_;
};

/// One line: scheme, solver, precision, unknowns, near pairs, and why this solver.
std::string describe_decision(const SkinScattering& scattering);

}  // namespace touchfield
