#include "sim/run/methods.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/field/metrics.h"
#include "sim/gpu/gpu.h"
#include "sim/model/model.h"
#include "sim/run/run_file.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

Eigen::MatrixXcd random_starts(Eigen::Index size, const StartSpec& start) {
  Eigen::MatrixXcd starts(size, start.restarts);
  for (int i = 0; i < start.restarts; ++i) {
    starts.col(i) = random_start(size, start.seed + static_cast<unsigned>(i));
  }
  return starts;
}

/// Phases of the finished run that a method starts from (`start: {previous: RUN.h5}`), of its method of the same name
/// or, if the start names none and there is none, of its first.
Eigen::VectorXd previous_phases(const MethodSpec& method, Eigen::Index channels) {
  const StartSpec& start = method.start;
  const Run run = [&] {
    try {
      return read_run_file(start.file);
    } catch (const Error& error) {
      throw InputError(fmt::format("start of {}: {}", method.name, error.what()));
    }
  }();
  auto found = std::ranges::find(run.methods, start.method.empty() ? method.name : start.method, &MethodResult::name);
  if (found == run.methods.end() && start.method.empty()) {
    found = run.methods.begin();
  }
  require(found != run.methods.end(), "start of {}: {} has no method {}", method.name, start.file,
          start.method.empty() ? "at all" : start.method);
  if (found->solution.phases.size() != channels) {
    throw InputError(fmt::format("start of {}: {} has {} channels, the array here has {}", method.name, start.file,
                                 found->solution.phases.size(), channels));
  }
  return found->solution.phases;
}

Eigen::VectorXcd unit_drives(const Eigen::VectorXd& phases) {
  return (Complex(0, 1) * phases.cast<Complex>()).array().exp();
}

/// Angles [theta; phi] to start from, one column a start.
Eigen::MatrixXd start_angles(const MethodSpec& method, const IncidentProblem& problem, const Eigen::VectorXcd* before) {
  const Eigen::Index size = problem.size();
  if (before == nullptr && method.start.kind == StartSpec::Kind::kRandom) {
    return random_starts(size, method.start).cwiseArg();
  }
  Eigen::MatrixXd angles = Eigen::MatrixXd::Zero(size, 1);
  if (before != nullptr || method.start.kind == StartSpec::Kind::kPrevious) {
    const Eigen::Index channels = problem.channel_count();
    const Eigen::VectorXd phases = before != nullptr ? before->cwiseArg() : previous_phases(method, channels);
    angles.col(0).tail(channels) = phases;
    // theta that fits these drives, the other faces' aside.
    Eigen::VectorXcd drives = Eigen::VectorXcd::Zero(size);
    drives.tail(channels) = -unit_drives(phases);
    Eigen::VectorXcd fitting;
    multiply_by_gram(problem, drives, fitting);
    angles.col(0).head(problem.target_count) = fitting.head(problem.target_count).cwiseArg();
  }
  return angles;
}

/// The drives of `fixed`.
PhaseSolution given_drives(const MethodSpec& method, Eigen::Index channels) {
  const auto each = [&](const std::vector<double>& values) -> Eigen::VectorXd {
    if (values.size() == 1) {
      return Eigen::VectorXd::Constant(channels, values.front());
    }
    return Eigen::Map<const Eigen::VectorXd>(values.data(), channels);
  };
  PhaseSolution given = full_drive(each(method.phases));
  given.amplitudes = each(method.amplitudes);
  return given;
}

/// Drives to start from, one column a start.
Eigen::MatrixXcd start_drives(const MethodSpec& method, const SkinProblem& problem) {
  const Eigen::Index channels = problem.channel_count();
  switch (method.start.kind) {
    case StartSpec::Kind::kAuto:
    case StartSpec::Kind::kZero:
      break;
    case StartSpec::Kind::kRandom:
      return random_starts(channels, method.start);
    case StartSpec::Kind::kAdjoint:
      return adjoint_start(problem);
    case StartSpec::Kind::kSpectral:
      return spectral_start(problem);
    case StartSpec::Kind::kPrevious:
      return unit_drives(previous_phases(method, channels));
  }
  return Eigen::MatrixXcd::Ones(channels, 1);
}

/// The solution of least final cost among those of several starts, a column each.
template <class Starts, class Solve>
PhaseSolution best_of(const Starts& starts, const Solve& solve) {
  std::optional<PhaseSolution> best;
  for (const auto& start : starts.colwise()) {
    PhaseSolution solution = solve(start);
    if (!best || solution.cost_history.back() < best->cost_history.back()) {
      best = std::move(solution);
    }
  }
  return *best;
}

/// Minimum of f over low..high by golden-section search in the logarithm.
double golden_section(const std::function<double(double)>& f, double low, double high, int evaluations) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  double a = std::log(low);
  double b = std::log(high);
  double x1 = b - ratio * (b - a);
  double x2 = a + ratio * (b - a);
  double f1 = f(std::exp(x1));
  double f2 = f(std::exp(x2));
  for (int i = 2; i < evaluations; ++i) {
    if (f1 < f2) {
      b = x2;
      x2 = x1;
      f2 = f1;
      x1 = b - ratio * (b - a);
      f1 = f(std::exp(x1));
    } else {
      a = x1;
      x1 = x2;
      f1 = f2;
      x2 = a + ratio * (b - a);
      f2 = f(std::exp(x2));
    }
  }
  return std::exp(f1 < f2 ? x1 : x2);
}

}  // namespace

void leave_out_dead(const ChannelResponse& response, PhaseSolution& solution) {
  for (Eigen::Index n = 0; n < response.gain.size(); ++n) {
    if (response.gain(n) == 0) {
      solution.phases(n) = 0.0;
      solution.amplitudes(n) = 0.0;
    }
  }
}

void require_fitting_phases(const MethodSpec& method, Eigen::Index channels) {
  const auto require_fitting = [&](const std::vector<double>& values, const char* what) {
    const auto count = static_cast<Eigen::Index>(values.size());
    require(count == 1 || count == channels,
            "solve.methods: {} has {} {}, it must have 1 or one for each of the {} channels", method.name, count, what,
            channels);
  };
  if (method.kind->model == MethodModel::kGiven) {
    require_fitting(method.phases, "phases");
    require_fitting(method.amplitudes, "amplitudes");
  }
  if (method.kind->iterates && method.start.kind == StartSpec::Kind::kPrevious) {
    previous_phases(method, channels);
  }
}

void require_fitting_phases(const Model& model) {
  for (const MethodSpec& method : model.fixed->scene.solve.methods) {
    require_fitting_phases(method, model.fixed->array.size());
  }
}

MethodSolver::MethodSolver(SkinScattering& scattering, Eigen::Index channels, std::optional<Target> target,
                           SolveSpec spec, OutsideSkin outside, std::shared_ptr<IncidentGrams> grams)
    : scattering_(scattering),
      channels_(channels),
      target_(std::move(target)),
      spec_(std::move(spec)),
      outside_(std::move(outside)),
      gram_free_(std::move(grams)) {}

void MethodSolver::aim(Target target) {
  target_ = std::move(target);
  transfer_.reset();
  columns_.resize(0, 0);
  central_row_.resize(0);
}

PhaseSolution MethodSolver::solve(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress,
                                  const Eigen::VectorXcd* before) {
  PhaseSolution solution;
  try {
    solution = found(method, amplitudes, progress, before);
  } catch (const GpuMemoryFailure& failure) {
    progress.warn(fmt::format("method {}: {}; the processor continues", method.name, failure.what()));
    leave_card_ = true;
    if (transfer_) {
      transfer_->reduction.problem.device.reset();
    }
    solution = found(method, amplitudes, progress, before);
  } catch (const GpuFailure& failure) {
    throw DeviceError(fmt::format("method {}: {}", method.name, failure.what()));
  }
  if (method.kind->model != MethodModel::kGiven) {
    leave_out_dead(scattering_.array().response, solution);
  }
  return solution;
}

PhaseSolution MethodSolver::found(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress,
                                  const Eigen::VectorXcd* before) {
  const auto advance = [&](int iteration, double) {
    progress.advance(static_cast<double>(iteration) / method.iterations);
  };
  switch (method.kind->model) {
    case MethodModel::kScattered:
    case MethodModel::kFree:
    case MethodModel::kSkin:
      try {
        return method.kind->radiation ? solve_radiation_method(method, amplitudes, before, progress)
               : method.kind->model == MethodModel::kSkin
                   ? solve_skin_method(method, amplitudes, before, advance, progress)
                   : solve_incident_method(method, amplitudes, before, advance);
      } catch (const std::invalid_argument& error) {
        throw NumericalError(fmt::format("method {}: {}", method.name, error.what()));
      } catch (const std::domain_error& error) {
        throw NumericalError(fmt::format("method {}: {}", method.name, error.what()));
      }
    case MethodModel::kCentre:
      // Phase conjugation: every channel arrives at the central face in phase.
      return full_drive(-central_row().transpose().cwiseArg());
    case MethodModel::kGiven:
      require_fitting_phases(method, channels_);
      return given_drives(method, channels_);
  }
  throw std::logic_error("unknown method");
}

Eigen::VectorXcd MethodSolver::pressure(const Eigen::VectorXcd& drives) {
  return spanned_ ? Eigen::VectorXcd(spanned_->pressure * (spanned_->drives.adjoint() * drives))
                  : Eigen::VectorXcd(scattering_.pressure(drives, "frame", true));
}

const Eigen::MatrixXcd& MethodSolver::weighted_gram_of(const Eigen::MatrixXcd& g, const Eigen::VectorXd& weights,
                                                       FaceWeights faces, IncidentGrams& kept) const {
  Eigen::MatrixXcd& gram = kept[faces];
  if (gram.size() == 0) {
    gram = weighted_gram(g, weights);
    if (!outside_.beyond.empty()) {
      const ScatteringSystem& system = scattering_.system();
      gram += outside_.beyond_gram(faces, system.wave(), system.mesh().areas().mean());
    }
  }
  return gram;
}

/// sum s w (|p| - p')^2 + (1 - s) w |p|^2 = sum w (|p| - s p')^2, but for a constant.
Eigen::VectorXd MethodSolver::face_means(const Eigen::VectorXd& amplitudes) const {
  return target_->shares.cwiseProduct(amplitudes);
}

IncidentProblem MethodSolver::unscattered(const Eigen::VectorXd& amplitudes, FaceWeights faces) {
  const Eigen::MatrixXcd& g = scattering_.unit_field().pressure;
  const Eigen::VectorXd weights = outside_.misfit_weights(faces, scattering_.system().mesh().areas(), g.rows());
  return unscattered_problem(target_->faces, g, weighted_gram_of(g, weights, faces, *gram_free_),
                             face_means(amplitudes), weights);
}

IncidentProblem MethodSolver::scattered(const Eigen::VectorXd& amplitudes, FaceWeights faces) {
  const ScatteringSystem& system = scattering_.system();
  const IncidentField& unit = scattering_.unit_field();
  if (columns_.size() == 0) {
    columns_ = system.columns(target_->faces);
  }
  const Eigen::VectorXd weights = outside_.misfit_weights(faces, system.mesh().areas(), columns_.rows());
  if (unit.slope.size() == 0 && unit.interior.size() == 0) {  // b is the incident pressure itself
    const Eigen::MatrixXcd& gram = weighted_gram_of(unit.pressure, weights, faces, *gram_free_);
    return scattered_problem(columns_, unit.pressure, gram, face_means(amplitudes), weights);
  }
  if (b_.size() == 0) {
    b_ = system.right_hand_side(unit);
  }
  return scattered_problem(columns_, b_, weighted_gram_of(b_, weights, faces, gram_b_), face_means(amplitudes),
                           weights);
}

PhaseSolution MethodSolver::solve_incident_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                                  const Eigen::VectorXcd* before, const IterationCallback& advance) {
  LevenbergMarquardtOptions options;
  options.iterations = method.iterations;
  const bool free = method.kind->model == MethodModel::kFree;
  std::optional<IncidentProblem> on_card;
  if (!leave_card_) {
    const ScatteringSystem& system = scattering_.system();
    const Eigen::VectorXd& areas = system.mesh().areas();
    on_card = scattering_.incident_on_card(target_->faces, face_means(amplitudes),
                                           outside_.misfit_weights(method.faces, areas, areas.size()),
                                           outside_.beyond_gram(method.faces, system.wave(), areas.mean()), !free);
  }
  const IncidentProblem problem = on_card ? std::move(*on_card)
                                  : free  ? unscattered(amplitudes, method.faces)
                                          : scattered(amplitudes, method.faces);
  return best_of(start_angles(method, problem, before),
                 [&](const auto& start) { return solve_incident(problem, start, options, advance); });
}

const SkinProblem& MethodSolver::skin_problem(const Eigen::VectorXd& amplitudes, Progress& progress) {
  const bool outside = spec_.optimality_bound || std::ranges::any_of(spec_.methods, [](const MethodSpec& method) {
                         return method.kind->counts_outside;
                       });
  return transfer(amplitudes, outside ? spec_.outside_weight : 0.0, progress).reduction.problem;
}

const Transfer& MethodSolver::transfer(const Eigen::VectorXd& amplitudes, double outside_weight, Progress& progress) {
  if (!transfer_ || transfer_->outside_weight < outside_weight) {
    transfer_.reset();
    if (std::ranges::any_of(spec_.methods, [](const MethodSpec& method) { return method.kind->radiation; })) {
      const ScatteringSystem& system = scattering_.system();
      near_ = near_skin(system.mesh(), *target_, system.wave());
    }
    if (drives_ && !spanned_) {
      transfer_ = make_transfer_on_card(scattering_, drives_, *target_, outside_, outside_weight, near_.faces);
    }
    if (!transfer_ && drives_ && !spanned_) {
      spanned_ = spanned_pressure(scattering_, *drives_);
    }
    if (!transfer_) {
      transfer_ = spanned_
                      ? make_transfer(*spanned_, scattering_, *target_, outside_, outside_weight, false, near_.faces)
                      : make_transfer(scattering_, *target_, outside_, outside_weight, near_.faces);
    }
    progress.detail(describe_transfer(*transfer_, channels_));
    if (Gpu* const gpu = scattering_.gpu(); gpu != nullptr && !leave_card_) {
      move_to(*gpu, transfer_->reduction.problem);
    }
  }
  transfer_->reduction.problem.amplitudes = amplitudes;
  return *transfer_;
}

RunTransfer MethodSolver::run_transfer(const Eigen::VectorXd& amplitudes, Progress& progress) {
  const Transfer& made = transfer(amplitudes, spec_.outside_weight, progress);
  return {to_string(scattering_.system().scheme()),
          made.reduction.problem,
          scattering_.unit_field().pressure(target_->faces, Eigen::all),
          made.outside_weight,
          made.channels_left_out,
          made.reduction.left_out};
}

PhaseSolution MethodSolver::solve_skin_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                              const Eigen::VectorXcd* before, const IterationCallback& advance,
                                              Progress& progress) {
  MethodSettings settings{method.iterations, method.free_amplitudes, method.free_level,
                          method.tolerances.value_or(ChannelTolerances{})};
  const SkinProblem& problem = skin_problem(amplitudes, progress);
  if (!method.kind->iterates) {
    return method.kind->solve(problem, {}, settings, advance);
  }
  if (before != nullptr) {
    return method.kind->solve(problem, *before, settings, advance);
  }
  settings.search = method.kind->searches && (method.start.kind == StartSpec::Kind::kAuto || method.start.among);
  if (settings.search) {
    const Eigen::MatrixXcd others =
        method.start.among ? start_drives(method, problem) : Eigen::MatrixXcd(problem.channel_count(), 0);
    return method.kind->solve(problem, others, settings, advance);
  }
  return best_of(start_drives(method, problem),
                 [&](const auto& start) { return method.kind->solve(problem, start, settings, advance); });
}

RadiationProblem MethodSolver::radiation_problem(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                                 Progress& progress) {
  require(spec_.outside_weight > 0,
          "solve.outside_weight = 0: method {} needs the skin outside the target; it must be > 0", method.name);
  skin_problem(amplitudes, progress);
  const ScatteringSystem& system = scattering_.system();
  RadiationProblem problem{.rows = transfer_->rows, .outside = transfer_->reduction.problem.outside};
  Eigen::VectorXd counted = Eigen::VectorXd::Zero(problem.rows.rows() + problem.outside.rows());
  counted.tail(problem.outside.rows()).setConstant(1.0 / transfer_->outside_weight);  // R has it
  problem.skin = radiation_skin(near_, system.mesh(), *target_, amplitudes, outside_, system.wave(),
                                method.outside_weight, counted);
  return problem;
}

PhaseSolution MethodSolver::solve_radiation_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                                   const Eigen::VectorXcd* before, Progress& progress) {
  RadiationProblem problem = radiation_problem(method, amplitudes, progress);
  if (method.tolerances) {
    problem = with_tolerances(std::move(problem), *method.tolerances);
  }
  if (Gpu* const gpu = scattering_.gpu(); gpu != nullptr && !leave_card_) {
    move_to(*gpu, problem);
  }
  const RadiationOptions options{
      .iterations = method.iterations, .free_amplitudes = method.free_amplitudes, .free_level = method.free_level};
  if (before != nullptr) {
    return solve_radiation(problem, *before, options);
  }
  if (method.start.kind != StartSpec::Kind::kAuto && !method.start.among) {
    return best_of(start_drives(method, transfer_->reduction.problem),
                   [&](const auto& start) { return solve_radiation(problem, start, options); });
  }
  Eigen::MatrixXcd starts = radiation_starts(problem);
  if (method.start.among) {
    starts.conservativeResize(Eigen::NoChange, starts.cols() + 1);
    starts.rightCols(1) = start_drives(method, transfer_->reduction.problem);
  }
  return solve_radiation(problem, starts, options);
}

const Eigen::RowVectorXcd& MethodSolver::central_row() {
  if (central_row_.size() == 0) {
    central_row_ = scattering_.transfer_rows({central_face(scattering_.system().mesh(), *target_)}, "focus");
  }
  return central_row_;
}

double MethodSolver::best_scale(const MethodSpec& method, const TriangleMesh& mesh, const std::vector<TargetBox>& boxes,
                                Progress& progress) {
  const auto evaluated = [&](double scale) {
    const PhaseSolution trial = solve(method, scale * target_->amplitudes, progress);
    const Eigen::VectorXcd pressure = scattering_.pressure(drive(trial), "scale");
    return method.kind->radiation ? metrics_of(mesh, scattering_.system().wave(), boxes, *target_, pressure)
                                  : pattern_metrics(mesh, boxes, *target_, pressure);
  };
  if (!method.kind->iterates) {
    const double scale = evaluated(1.0).scale;
    require(scale > 0, "target.pressure_pa: best is that of {}, which is silent: give a number", method.name);
    return 1.0 / scale;
  }
  constexpr double kLowest = 0.02;
  const double largest = most_pressure() / target_->amplitudes.maxCoeff();
  const auto error = method.kind->radiation ? &Metrics::relative_error_radiation : &Metrics::relative_error;
  return golden_section([&](double scale) { return evaluated(scale).*error; }, kLowest * largest, largest,
                        kScaleTrials);
}

}  // namespace touchfield
