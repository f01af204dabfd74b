#pragma once

#include <span>
#include <string_view>

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/radiation.h"
#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"

namespace touchfield {

/// What a phase method works on.
enum class MethodModel {
  kSkin,       // rows of the transfer matrix H: pressures on the skin itself
  kScattered,  // the matrix B and the incident field
  kFree,       // the incident field alone, as if the body did not scatter
  kCentre,     // one row of H: the target's central face
  kGiven,      // nothing: its phases are given
};

/// What a scene says of a method.
struct MethodSettings {
  int iterations = kUsualIterations;
  bool free_amplitudes = false;
  bool free_level = true;
  ChannelTolerances tolerances{};  // of surface: the expected misfit is minimised
  bool search = false;             // of a method that does: the starts are some among those it finds itself
};

/// starts     drives, N per column; none where the method does not iterate, any number where it searches, else one
using SkinMethod = PhaseSolution (*)(const SkinProblem& problem, const Eigen::MatrixXcd& starts,
                                     const MethodSettings& settings, const IterationCallback& callback);

/// A phase method: one row of the table in phase_methods.cpp. Scenes, their schema, cost estimates and the solving of a
/// model read no more than this of it.
struct PhaseMethod {
  std::string_view name;  // in scenes and results
  std::string_view help;
  MethodModel model = MethodModel::kSkin;
  bool iterates = false;         // takes a start and a number of iterations
  bool searches = false;         // can find a start of its own
  bool counts_outside = false;   // the skin outside the target counts in what it minimises
  bool free_amplitudes = false;  // takes that option
  bool radiation = false;  // minimises the misfit of radiation pressure (solve_radiation), with options of its own
  int iterations = kUsualIterations;
  SkinMethod solve = nullptr;  // of kSkin but for radiation
};

/// All there are, in the order of the schema.
std::span<const PhaseMethod> phase_methods();

/// throws   std::invalid_argument if there is none of the name
const PhaseMethod& phase_method(std::string_view name);

}  // namespace touchfield
