#include "solvers/phase/phase_methods.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "solvers/phase/baselines.h"

namespace touchfield {

namespace {

PhaseSolution surface(const SkinProblem& problem, const Eigen::MatrixXcd& starts, const MethodSettings& settings,
                      const IterationCallback& callback) {
  if (settings.tolerances.any()) {
    return solve_robust_surface(problem, starts, {settings.tolerances, settings.iterations, settings.search}, callback);
  }
  const SurfaceOptions options{.iterations = settings.iterations,
                               .free_amplitudes = settings.free_amplitudes,
                               .free_level = settings.free_level};
  return settings.search ? search_surface(problem, starts, options, callback)
                         : solve_surface(problem, starts, options, callback);
}

/// A baseline that starts from drives and iterates.
template <auto Solve>
PhaseSolution baseline(const SkinProblem& problem, const Eigen::MatrixXcd& starts, const MethodSettings& settings,
                       const IterationCallback& callback) {
  return Solve(problem, starts.col(0), {settings.iterations}, callback);
}

constexpr PhaseMethod kMethods[] = {
    {.name = "surface",
     .help = "Minimises the misfit of the pressure amplitudes on the skin itself, by Levenberg-Marquardt in a small "
             "system.",
     .model = MethodModel::kSkin,
     .iterates = true,
     .searches = true,
     .counts_outside = true,
     .free_amplitudes = true,
     .solve = surface},
    {.name = "radiation",
     .help = "Minimises the misfit of the radiation pressure on the skin, which is what the skin feels, by "
             "limited-memory BFGS.",
     .model = MethodModel::kSkin,
     .iterates = true,
     .searches = true,
     .counts_outside = true,
     .free_amplitudes = true,
     .radiation = true,
     .iterations = kUsualDescents},
    {.name = "paper",
     .help = "The published optimisation: minimises the misfit of the scattered field, by Levenberg-Marquardt.",
     .model = MethodModel::kScattered,
     .iterates = true},
    {.name = "unscattered",
     .help = "The published optimisation without scattering, for comparison.",
     .model = MethodModel::kFree,
     .iterates = true},
    {.name = "focus",
     .help = "Phase conjugation: the sound of all channels arrives at the target in phase.",
     .model = MethodModel::kCentre},
    {.name = "gs",
     .help = "Gerchberg-Saxton on the target's faces, for comparison.",
     .model = MethodModel::kSkin,
     .iterates = true,
     .solve = baseline<solve_gs>},
    {.name = "wgs",
     .help = "Weighted Gerchberg-Saxton, which equalises the faces.",
     .model = MethodModel::kSkin,
     .iterates = true,
     .solve = baseline<solve_wgs>},
    {.name = "gs_pat",
     .help = "GS-PAT: Gerchberg-Saxton in the space of the faces.",
     .model = MethodModel::kSkin,
     .solve = [](const SkinProblem& problem, const Eigen::MatrixXcd&, const MethodSettings& settings,
                 const IterationCallback&) { return solve_gs_pat(problem, {settings.iterations}); }},
    {.name = "eigen",
     .help = "Eigensolver: the phases on the faces that reinforce each other most, then the drive vector by least "
             "squares.",
     .model = MethodModel::kSkin,
     .solve = [](const SkinProblem& problem, const Eigen::MatrixXcd&, const MethodSettings&,
                 const IterationCallback&) { return solve_eigen(problem); }},
    {.name = "lbfgs",
     .help = "Minimises the misfit of surface by limited-memory BFGS.",
     .model = MethodModel::kSkin,
     .iterates = true,
     .counts_outside = true,
     .solve = baseline<solve_lbfgs>},
    {.name = "fixed", .help = "Given phases and amplitudes.", .model = MethodModel::kGiven},
};

}  // namespace

std::span<const PhaseMethod> phase_methods() { return kMethods; }

const PhaseMethod& phase_method(std::string_view name) {
  const auto* const found = std::ranges::find(kMethods, name, &PhaseMethod::name);
  if (found == std::end(kMethods)) {
    throw std::invalid_argument("unknown phase method " + std::string(name));
  }
  return *found;
}

}  // namespace touchfield
