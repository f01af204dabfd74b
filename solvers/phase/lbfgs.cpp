#include <algorithm>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <cmath>
#include <complex>
#include <glog/logging.h>
#include <utility>

#include "solvers/phase/baseline_support.h"
#include "solvers/phase/skin_field.h"
#include "solvers/phase/skin_jacobian.h"

namespace touchfield {

namespace {

constexpr double kTolerance = 1e-10;  // on the share by which a step lowers the cost, and on its gradient over the unit

/// skin_cost over the phases, in units in which Ceres' absolute gradient tolerance has a meaning.
class SkinCostOfPhases final : public ceres::FirstOrderFunction {
 public:
  SkinCostOfPhases(const SkinProblem& problem, double unit) : problem_(problem), unit_(unit), jacobian_(problem) {}

  int NumParameters() const override { return static_cast<int>(problem_.channel_count()); }

  bool Evaluate(const double* phases, double* cost, double* gradient) const override {
    phasors_.resize(problem_.channel_count());
    for (Eigen::Index n = 0; n < phasors_.size(); ++n) {
      phasors_(n) = std::polar(1.0, phases[n]);
    }
    send(problem_, phasors_, field_);
    *cost = field_cost(problem_, field_) / unit_;
    if (gradient != nullptr) {
      jacobian_.set(field_, phasors_);
      jacobian_.gradient(half_gradient_);
      Eigen::Map<Eigen::VectorXd>(gradient, phasors_.size()) = (2.0 / unit_) * half_gradient_;
    }
    return true;
  }

 private:
  const SkinProblem& problem_;
  double unit_;
  mutable SkinJacobian jacobian_;
  mutable SkinField field_;
  mutable Eigen::VectorXcd phasors_;
  mutable Eigen::VectorXd half_gradient_;
};

/// Keeps the costs after the first and passes them on.
class Reporter final : public ceres::IterationCallback {
 public:
  Reporter(PhaseSolution& solution, double unit, const touchfield::IterationCallback& callback)
      : solution_(solution), unit_(unit), callback_(callback) {}

  void note(int iteration, double cost) {
    if (iteration != static_cast<int>(solution_.cost_history.size())) {
      return;  // the start, or told already
    }
    solution_.cost_history.push_back(cost * unit_);
    if (callback_) {
      callback_(iteration, solution_.cost_history.back());
    }
  }

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    note(summary.iteration, summary.cost);
    return ceres::SOLVER_CONTINUE;
  }

 private:
  PhaseSolution& solution_;
  double unit_;
  const touchfield::IterationCallback& callback_;
};

/// Holds back the warnings that Ceres writes to stderr even where its options ask for silence.
class QuietLog {
 public:
  QuietLog() { FLAGS_minloglevel = google::GLOG_FATAL; }
  ~QuietLog() { FLAGS_minloglevel = before_; }
  QuietLog(const QuietLog&) = delete;
  QuietLog& operator=(const QuietLog&) = delete;

 private:
  int before_ = FLAGS_minloglevel;
};

PhaseStatus status_of(ceres::TerminationType type) {
  switch (type) {
    case ceres::CONVERGENCE:
      return PhaseStatus::kConverged;
    case ceres::NO_CONVERGENCE:
      return PhaseStatus::kIterationLimit;
    default:
      return PhaseStatus::kStalled;
  }
}

}  // namespace

PhaseSolution solve_lbfgs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                          const IterationCallback& callback) {
  require_valid(problem, "solve_lbfgs");
  require_valid(options, "solve_lbfgs");
  const Eigen::VectorXcd q = unit_start(problem, start, "solve_lbfgs");
  Eigen::VectorXd phases = q.cwiseArg();

  PhaseSolution solution;
  solution.cost_history.push_back(skin_cost(problem, q));
  const double unit = std::max(silent_cost(problem), solution.cost_history.front());
  if (unit > 0) {
    Reporter reporter(solution, unit, callback);
    ceres::GradientProblemSolver::Options settings;
    settings.max_num_iterations = options.iterations;
    settings.function_tolerance = kTolerance;
    settings.gradient_tolerance = kTolerance;
    settings.parameter_tolerance = kTolerance;
    settings.logging_type = ceres::SILENT;
    settings.update_state_every_iteration = true;  // else a failed line search leaves the start
    settings.callbacks.push_back(&reporter);
    ceres::GradientProblemSolver::Summary summary;
    const QuietLog quiet;
    ceres::Solve(settings, ceres::GradientProblem(new SkinCostOfPhases(problem, unit)), phases.data(), &summary);
    for (const ceres::IterationSummary& iteration : summary.iterations) {
      reporter.note(iteration.iteration, iteration.cost);
    }
    solution.status = status_of(summary.termination_type);
    solution.iterations = static_cast<int>(solution.cost_history.size()) - 1;
  } else {
    solution.status = PhaseStatus::kConverged;  // nothing is wanted and nothing sounds
  }
  solution.phases = wrapped(phases);
  solution.amplitudes = Eigen::VectorXd::Ones(phases.size());
  return solution;
}

}  // namespace touchfield
