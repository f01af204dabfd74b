#include "sim/solve/methods.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/field/pressure_metrics.h"
#include "sim/solve/previous_phases.h"
#include "sim/target/gram.h"
#include "solvers/linear/blas_product.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

/// Angles [theta; phi] to start from, one column a start.
Eigen::MatrixXd start_angles(const MethodSpec& method, const IncidentProblem& problem) {
  const Eigen::Index size = problem.gram.rows();
  const StartSpec& start = method.start;
  if (start.kind == StartSpec::Kind::kRandom) {
    Eigen::MatrixXd angles(size, start.restarts);
    for (int i = 0; i < start.restarts; ++i) {
      angles.col(i) = random_start(size, start.seed + static_cast<unsigned>(i)).cwiseArg();
    }
    return angles;
  }
  Eigen::MatrixXd angles = Eigen::MatrixXd::Zero(size, 1);
  if (start.kind == StartSpec::Kind::kPrevious) {
    const Eigen::Index channels = problem.channel_count();
    const Eigen::VectorXd phases = previous_phases(method, channels);
    const Eigen::VectorXcd q = (Complex(0, 1) * phases.cast<Complex>()).array().exp();
    angles.col(0).tail(channels) = phases;
    // theta that fits these drives, the other faces' aside.
    angles.col(0).head(problem.target_count) =
        (-(problem.gram.topRightCorner(problem.target_count, channels) * q)).cwiseArg();
  }
  return angles;
}

/// Drives to start from, one column a start.
Eigen::MatrixXcd start_drives(const MethodSpec& method, const SkinProblem& problem) {
  const Eigen::Index channels = problem.channel_count();
  const StartSpec& start = method.start;
  switch (start.kind) {
    case StartSpec::Kind::kZero:
      break;
    case StartSpec::Kind::kRandom: {
      Eigen::MatrixXcd drives(channels, start.restarts);
      for (int i = 0; i < start.restarts; ++i) {
        drives.col(i) = random_start(channels, start.seed + static_cast<unsigned>(i));
      }
      return drives;
    }
    case StartSpec::Kind::kAdjoint:
      return adjoint_start(problem);
    case StartSpec::Kind::kSpectral:
      return spectral_start(problem);
    case StartSpec::Kind::kPrevious:
      return (Complex(0, 1) * previous_phases(method, channels).cast<Complex>()).array().exp();
  }
  return Eigen::MatrixXcd::Ones(channels, 1);
}

/// The solution of least final cost among those of several starts.
void keep_best(std::optional<PhaseSolution>& best, PhaseSolution solution) {
  if (!best || solution.cost_history.back() < best->cost_history.back()) {
    best = std::move(solution);
  }
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

MethodSolver::MethodSolver(SkinScattering& scattering, Eigen::Index channels, const std::optional<Target>& target,
                           const SolveSpec& spec)
    : scattering_(scattering), channels_(channels), target_(target), spec_(spec) {}

PhaseSolution MethodSolver::solve(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress) {
  switch (method.kind->model) {
    case MethodModel::kScattered:
    case MethodModel::kFree:
      return solve_incident_method(method, amplitudes, progress);
    case MethodModel::kSkin:
      return solve_skin_method(method, amplitudes, progress);
    case MethodModel::kCentre:
      // Phase conjugation: every channel arrives at the central face in phase.
      return full_drive(-central_row().transpose().cwiseArg());
    case MethodModel::kGiven: {
      if (method.phases.size() == 1) {
        return full_drive(Eigen::VectorXd::Constant(channels_, method.phases.front()));
      }
      return full_drive(Eigen::Map<const Eigen::VectorXd>(method.phases.data(), channels_));
    }
  }
  throw std::logic_error("unknown method");
}

IncidentProblem MethodSolver::unscattered(const Eigen::VectorXd& amplitudes) {
  const Eigen::MatrixXcd& g = scattering_.unit_field().pressure;
  if (gram_free_.size() == 0) {
    gram_free_ = hermitian_product(g);
  }
  return unscattered_problem(target_->faces, g, gram_free_, amplitudes);
}

IncidentProblem MethodSolver::scattered(const Eigen::VectorXd& amplitudes) {
  const ScatteringSystem& system = scattering_.system();
  const IncidentField& unit = scattering_.unit_field();
  if (columns_.size() == 0) {
    columns_ = system.columns(target_->faces);
  }
  if (unit.slope.size() == 0 && unit.interior.size() == 0) {  // b is the incident pressure itself
    if (gram_free_.size() == 0) {
      gram_free_ = hermitian_product(unit.pressure);
    }
    return scattered_problem(columns_, unit.pressure, gram_free_, amplitudes);
  }
  if (b_.size() == 0) {
    b_ = system.right_hand_side(unit);
    gram_b_ = hermitian_product(b_);
  }
  return scattered_problem(columns_, b_, gram_b_, amplitudes);
}

PhaseSolution MethodSolver::solve_incident_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                                  Progress& progress) {
  LevenbergMarquardtOptions options;
  options.iterations = method.iterations;
  try {
    const IncidentProblem problem =
        method.kind->model == MethodModel::kFree ? unscattered(amplitudes) : scattered(amplitudes);
    std::optional<PhaseSolution> best;
    const Eigen::MatrixXd starts = start_angles(method, problem);
    for (const auto& start : starts.colwise()) {
      keep_best(best, solve_incident(problem, start, options, [&](int iteration, double) {
                  progress.advance(static_cast<double>(iteration) / method.iterations);
                }));
    }
    return *best;
  } catch (const std::invalid_argument& error) {
    throw NumericalError(fmt::format("method {}: {}", method.name, error.what()));
  }
}

const SkinProblem& MethodSolver::skin_problem(const Eigen::VectorXd& amplitudes, Progress& progress) {
  if (!transfer_) {
    const bool quiet = spec_.certificate || std::ranges::any_of(spec_.methods, [](const MethodSpec& method) {
                         return method.kind->minds_quiet;
                       });
    transfer_ = make_transfer(scattering_, *target_, quiet ? spec_.quiet_weight : 0.0);
    progress.note(describe_transfer(*transfer_, channels_));
  }
  transfer_->reduction.problem.amplitudes = amplitudes;
  return transfer_->reduction.problem;
}

PhaseSolution MethodSolver::solve_skin_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                              Progress& progress) {
  const auto advance = [&](int iteration, double) {
    progress.advance(static_cast<double>(iteration) / method.iterations);
  };
  const MethodSettings settings{method.iterations, method.free_amplitudes};
  try {
    const SkinProblem& problem = skin_problem(amplitudes, progress);
    if (!method.kind->iterates) {
      return method.kind->solve(problem, {}, settings, advance);
    }
    std::optional<PhaseSolution> best;
    const Eigen::MatrixXcd starts = start_drives(method, problem);
    for (const auto& start : starts.colwise()) {
      keep_best(best, method.kind->solve(problem, start, settings, advance));
    }
    return *best;
  } catch (const std::invalid_argument& error) {
    throw NumericalError(fmt::format("method {}: {}", method.name, error.what()));
  } catch (const std::domain_error& error) {
    throw NumericalError(fmt::format("method {}: {}", method.name, error.what()));
  }
}

const Eigen::RowVectorXcd& MethodSolver::central_row() {
  if (central_row_.size() == 0) {
    central_row_ = scattering_.transfer_rows({central_face(scattering_.system().mesh(), *target_)}, "focus");
  }
  return central_row_;
}

double MethodSolver::best_scale(const MethodSpec& method, const TriangleMesh& mesh, const Wave& wave,
                                const std::vector<TargetBox>& boxes, Progress& progress) {
  const auto judged = [&](double scale) {
    const PhaseSolution trial = solve(method, scale * target_->amplitudes, progress);
    return metrics_of(mesh, wave, boxes, *target_, scattering_.pressure(drive(trial), "scale"));
  };
  if (!method.kind->iterates) {
    return 1.0 / judged(1.0).scale;
  }
  constexpr int kEvaluations = 9;  // narrows 1/50..1 to a factor of 1.09
  constexpr double kLowest = 0.02;
  const double largest = central_row().cwiseAbs().sum() / target_->amplitudes.maxCoeff();
  return golden_section([&](double scale) { return judged(scale).relative_error; }, kLowest * largest, largest,
                        kEvaluations);
}

}  // namespace touchfield
