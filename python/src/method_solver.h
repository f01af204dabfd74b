#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "python/src/parts.h"
#include "sim/core/require.h"
#include "sim/run/methods.h"
#include "sim/run/skin_scattering.h"
#include "solvers/phase/radiation.h"
#include "solvers/phase/surface.h"

namespace touchfield::python {

inline constexpr double kOutsideTolerance = 1e-4;  // of reduced_skin_problem, as make_transfer

/// The factor on a target of 1 Pa that a run of a scene finds which asks for the best pressure.
double best_scale_of(const Model& model, Progress& progress);

/// Asks the solver of a model's methods by a scheme, for the target.
///
/// spec   the scene's, or one with other methods
template <typename Ask>
auto asked(const Model& model, Scheme scheme, const SolveSpec& spec, Progress& progress, Ask ask) {
  require(model.posture.target.has_value(), "scene {}: it has no target, which the phase methods need",
          model.fixed->scene.name);
  require_fitting_phases(model);
  std::vector<SolveRecord> records;
  const auto scattering = make_scattering("python", model.body.mesh, scheme, model.fixed->scene.solve.solver,
                                          largest_block(model.fixed->scene, scheme, model.fixed->array.size(), false),
                                          model, model.fixed->array.response, nullptr, records, progress);
  Target target = build_target(model);
  if (asks_for_best(model)) {
    target.amplitudes *= best_scale_of(model, progress);
  }
  MethodSolver solver(*scattering, model.fixed->array.size(), target, spec, outside_skin(model));
  return ask(solver, target);
}

/// The problem of H of every face, with the skin outside the target reduced to a few rows, or of the target's faces.
SharedProblem skin_problem(std::string_view who, nb::handle h, const SharedTarget& target, double outside_weight,
                           std::optional<int> threads);

/// All pressures are rows of the problem's F; its R is empty.
struct SkinRadiation {
  RadiationProblem problem;
  std::vector<std::int64_t> faces;  // of the mesh, which P is of; empty: not said
};
using SharedRadiation = Shared<SkinRadiation>;

/// The same for the radiation pressure, of H of every face.
SharedRadiation radiation_problem(std::string_view who, nb::handle h, const SharedTarget& target, double outside_weight,
                                  const std::optional<Wave>& wave, std::optional<int> threads);

/// Drives q of one solution, for a function `what`.
/// throws   InputError unless there is one per channel
Eigen::VectorXcd one_drive(nb::handle drives, const std::string& what, Eigen::Index channels);

}  // namespace touchfield::python
