#include "sim/run/result_warnings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/acoustics/incident_field.h"
#include "sim/model/evaluation.h"
#include "sim/run/estimates.h"
#include "sim/run/text_table.h"
#include "solvers/phase/phase_methods.h"

namespace touchfield {

namespace {

constexpr double kLargestResonance = 0.1;
constexpr double kLargestAmplification = 2.0;
constexpr double kNotableSigma = 0.3;
constexpr double kShock = 1.0;

void remark_reach(const Run& run, double most, Remarks& remarks) {
  std::string reached;
  double wanted = 0.0;
  for (const MethodResult* method : methods_below_wanted(run)) {
    const Metrics& metrics = method->metrics;
    wanted = metrics.mean_inside_pa / metrics.reached_share;
    reached += fmt::format("{}{} reaches {} ({:.2g} %)", reached.empty() ? "" : ", ", method->name,
                           pressure_text(metrics.mean_inside_pa), 100.0 * metrics.reached_share);
  }
  if (!reached.empty()) {
    remarks.warnings.push_back(
        fmt::format("below_wanted: {} of the wanted {} on the target; the array makes at most {} on its central face",
                    reached, pressure_text(wanted), pressure_text(most)));
  }
}

void remark_unconverged(const Run& run, Remarks& remarks) {
  for (const SolveRecord& solve : run.solves) {
    if (!solve.converged && solve.stage != "resonance_check") {
      remarks.warnings.push_back(
          fmt::format("not_converged: {}: scheme {} by {} reached a residual of {:.1e} in {} steps", solve.stage,
                      solve.scheme, solve.solver, solve.residual, solve.steps));
    }
  }
}

/// Figures of an evaluation in a scheme with a cure are right whatever phases they are of.
void remark_resonances(const Run& run, Remarks& remarks) {
  const bool cured = run.evaluation_model && std::ranges::any_of(all_schemes(), [&](Scheme scheme) {
                       return has_cure(scheme) && to_string(scheme) == run.evaluation_model->scheme;
                     });
  for (const auto& [scheme, resonance_check] : run.resonance_checks) {
    if (resonance_check > kLargestResonance) {
      (cured ? remarks.notes : remarks.warnings)
          .push_back(fmt::format("fictitious_frequency: scheme {} differs from Burton-Miller by {:.1f} %: the inside "
                                 "of this body resonates near this frequency, or the mesh is too coarse{}",
                                 scheme, 100.0 * resonance_check,
                                 cured ? ". Its phases are found with that error; the evaluation is free of it" : ""));
    }
  }
}

void remark_shadow(const Run& run, Remarks& remarks) {
  if (run.target && !run.methods.empty() && run.methods.front().pressure.size() > 0) {
    const Eigen::VectorXd power = run.methods.front().pressure.cwiseAbs2();
    const Eigen::VectorXd& area = run.mesh.areas();
    const Eigen::VectorXd inside = run.target->areas(area);
    const double on_target = inside.dot(power(run.target->faces)) / inside.sum();
    const double amplification = std::sqrt(area.dot(power) / area.sum() / on_target);
    if (amplification > kLargestAmplification) {
      remarks.warnings.push_back(
          fmt::format("deep_shadow: with method {1} the mean pressure of the skin is {0:.1f} times that of the target; "
                      "errors count that many times there",
                      amplification, run.methods.front().name));
    }
  }
}

/// Names and sigmas of the methods from `least` to below `end`, the largest of them in `largest`.
std::string steepened(const Run& run, double least, double end, double& largest) {
  std::string methods;
  largest = 0.0;
  for (const MethodResult& method : run.methods) {
    const double sigma = method.shock_distance_share;
    if (sigma >= least && sigma < end) {
      methods += fmt::format("{}{} {:.2f}", methods.empty() ? "" : ", ", method.name, sigma);
      largest = std::max(largest, sigma);
    }
  }
  return methods;
}

/// What a plane wave without losses has lost at `sigma`: "1.2 % of its pressure at the frequency of the array".
std::string plane_wave_text(double sigma) {
  return fmt::format("a plane wave loses {:.2g} % of its pressure at the frequency of the array by sigma {:.2f}",
                     100.0 * (1.0 - plane_wave_harmonic(1, sigma)), sigma);
}

void remark_nonlinearity(const Run& run, Remarks& remarks) {
  double largest = 0.0;
  if (const std::string methods = steepened(run, kShock, HUGE_VAL, largest); !methods.empty()) {
    remarks.warnings.push_back(fmt::format(
        "nonlinear: the sound is so loud that a shock forms on the way to the skin, which this model leaves "
        "out. It forms at sigma 1; here sigma is {}. The pressures are too high: {}. Lower array.level",
        methods, plane_wave_text(kShock)));
  }
  if (const std::string methods = steepened(run, kNotableSigma, kShock, largest); !methods.empty()) {
    remarks.notes.push_back(
        fmt::format("nonlinear: the sound is so loud that it steepens on the way to the skin, which this model leaves "
                    "out. A shock would form at sigma 1; here it is {}. The pressures are slightly too high: {}",
                    methods, plane_wave_text(largest)));
  }
}

constexpr double kTolerance = 1e-3;
constexpr int kMaxSteps = 60;
constexpr double kFreeSeconds = 0.25;  // spent on the resonance check whatever the run takes
constexpr double kShare = 0.5;         // of the run's own solving, where a warning depends on it
constexpr double kShareCured = 0.1;    // the same of a scheme that needs no warning

}  // namespace

std::string pressure_text(double pa) {
  if (pa < 999.5) {
    return fmt::format("{:.3g} Pa", pa);
  }
  return pa < 999.5e3 ? fmt::format("{:.3g} kPa", 1e-3 * pa) : grouped(std::lround(1e-3 * pa)) + " kPa";
}

std::vector<const MethodResult*> methods_below_wanted(const Run& run) {
  std::vector<const MethodResult*> methods;
  const bool best = std::ranges::any_of(run.seconds, [](const auto& stage) { return stage.first == kScaleStage; });
  for (const MethodResult& method : run.methods) {
    if (!best && phase_method(method.method).model != MethodModel::kGiven &&
        method.metrics.reached_share < kLeastReached) {
      methods.push_back(&method);
    }
  }
  return methods;
}

Remarks result_remarks(const Run& run, double most) {
  Remarks remarks;
  remark_reach(run, most, remarks);
  remark_unconverged(run, remarks);
  remark_resonances(run, remarks);
  remark_shadow(run, remarks);
  remark_nonlinearity(run, remarks);
  return remarks;
}

std::string reach_warning(const Model& model) {
  constexpr Eigen::Index kMostFaces = 200;  // sound changes little from one to the next
  constexpr double kWall = 2.0;
  const Scene& scene = model.fixed->scene;
  const bool searched = std::ranges::any_of(
      scene.solve.methods, [](const MethodSpec& method) { return method.kind->model != MethodModel::kGiven; });
  if (!scene.target || !scene.target->pressure || !searched) {
    return "";
  }
  const Target target = build_target(model);
  const Eigen::VectorXd areas = target.areas(model.body.mesh.areas());
  const double wanted = areas.dot(target.amplitudes) / areas.sum();
  double most = 0.0;
  for (Eigen::Index i = 0; i < target.size(); i += 1 + target.size() / kMostFaces) {
    const Points at = model.body.mesh.centroids().col(target.faces[static_cast<std::size_t>(i)]);
    most = std::max(most, kWall * incident_matrix(model.fixed->array, model.fixed->wave, at).cwiseAbs().sum());
  }
  return most >= kLeastReached * wanted
             ? ""
             : fmt::format("below_wanted: the array makes at most about {} on the target, {:.2g} % of the wanted {}",
                           pressure_text(most), 100.0 * most / wanted, pressure_text(wanted));
}

double resonance_check_seconds(bool plain, double product) { return (plain ? 15.0 : kMaxSteps) * product; }

bool has_cure(Scheme scheme) { return traits(scheme).burton_miller; }

bool wants_resonance_check(ResonanceCheck choice, bool plain, double seconds, double spent) {
  return choice == ResonanceCheck::kAlways ||
         (choice == ResonanceCheck::kAuto && seconds <= std::max(kFreeSeconds, (plain ? kShare : kShareCured) * spent));
}

double resonance_difference(const SkinScattering& scattering, SkinScattering* cured, const SolverSpec& spec,
                            const Eigen::VectorXcd& drive, const Eigen::VectorXcd& own, double spent,
                            std::vector<SolveRecord>& records, Progress& progress) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  const TriangleMesh& mesh = scattering.system().mesh();
  const Wave& wave = scattering.system().wave();
  const bool plain = !has_cure(scattering.system().scheme());
  SkinScattering* ready = plain ? cured : nullptr;
  const Scheme other =
      ready != nullptr ? ready->system().scheme() : (plain ? Scheme::kBurtonMiller : Scheme::kPaperCorrected);
  if (spec.resonance_check == ResonanceCheck::kNever) {
    return nothing;
  }
  const SolverKind kind = scattering.decision().options.kind;
  const bool by_grid = kind == SolverKind::kFft;
  SolverSpec quick = spec;
  quick.solver = by_grid ? SolverChoice::kFft : SolverChoice::kMatrixFree;
  quick.precision = by_grid ? PrecisionChoice::kAuto : PrecisionChoice::kSingle;
  quick.refine = false;
  quick.tolerance = kTolerance;
  quick.max_steps = kMaxSteps;
  const double share = product_share(kind, mesh.face_count(), body_cost(grid_body(mesh), wave, quick).grid.seconds);
  const double expected = resonance_check_seconds(plain, share * product_seconds(mesh, wave));
  if (!wants_resonance_check(spec.resonance_check, plain, expected, spent)) {
    progress.detail(fmt::format(
        "  resonance check: skipped, {} would take about {:.1f} s more (solve.resonance_check: always requests it)",
        to_string(other), expected));
    return nothing;
  }
  const auto compared = [&] {
    SkinScattering solved(mesh, wave, other, quick, scattering.array(), records, progress);
    solved.allow_broken();
    return solved.pressure(drive, "resonance_check");
  };
  const Eigen::VectorXcd p = ready != nullptr ? ready->pressure(drive, "resonance_check") : compared();
  const Eigen::VectorXcd& reference = plain ? p : own;
  const double resonance_check = relative_difference(mesh.areas(), plain ? own : p, reference);
  const bool settled = records.back().residual <= 2.0 * kTolerance;
  progress.detail(fmt::format(
      "  resonance check: pressures of {} and {} differ by {:.2f} %{}", to_string(scattering.system().scheme()),
      to_string(other), 100.0 * resonance_check,
      settled ? "" : fmt::format(" ({} stopped at a residual of {:.1e})", to_string(other), records.back().residual)));
  return resonance_check;
}

}  // namespace touchfield
