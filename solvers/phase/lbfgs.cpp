#include <algorithm>
#include <cmath>
#include <complex>
#include <lbfgs.h>
#include <memory>
#include <new>
#include <utility>

#include "solvers/phase/baseline_support.h"
#include "solvers/phase/skin_jacobian.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

namespace {

constexpr double kTolerance = 1e-10;  // on the share by which a step lowers the cost, and on its gradient over the unit
constexpr int kRank = 20;
constexpr int kConverged = 1;  // what ends the library's iterations from within

/// skin_cost over the phases, in units in which a tolerance on the gradient has a meaning, and what comes of it.
class Descent {
 public:
  Descent(const SkinProblem& problem, double unit, PhaseSolution& solution, const IterationCallback& callback)
      : problem_(problem), unit_(unit), jacobian_(problem), solution_(solution), callback_(callback) {}

  /// n may be rounded up: what is behind the phases has no gradient.
  double evaluate(const double* phases, double* gradient, int n) {
    phasors_.resize(problem_.channel_count());
    for (Eigen::Index k = 0; k < phasors_.size(); ++k) {
      phasors_(k) = std::polar(1.0, phases[k]);
    }
    send(problem_, phasors_, field_);
    jacobian_.set(field_, phasors_);
    jacobian_.gradient(half_gradient_);
    Eigen::Map<Eigen::VectorXd> all(gradient, n);
    all.setZero();
    all.head(phasors_.size()) = (2.0 / unit_) * half_gradient_;
    return field_cost(problem_, field_) / unit_;
  }

  /// returns   kConverged, or 0 to go on
  int progress(const double* gradient, double cost, int n) {
    const double before = solution_.cost_history.back();
    solution_.cost_history.push_back(cost * unit_);
    if (callback_) {
      callback_(static_cast<int>(solution_.cost_history.size()) - 1, solution_.cost_history.back());
    }
    const bool flat = flat_here(gradient, n);
    return flat || before - solution_.cost_history.back() <= kTolerance * before ? kConverged : 0;
  }

  static bool flat_here(const double* gradient, int n) {
    return Eigen::Map<const Eigen::VectorXd>(gradient, n).cwiseAbs().maxCoeff() <= kTolerance;
  }

 private:
  const SkinProblem& problem_;
  double unit_;
  SkinJacobian jacobian_;
  SkinField field_;
  Eigen::VectorXcd phasors_;
  Eigen::VectorXd half_gradient_;
  PhaseSolution& solution_;
  const IterationCallback& callback_;
};

double evaluate(void* descent, const double* phases, double* gradient, int n, double /*step*/) {
  return static_cast<Descent*>(descent)->evaluate(phases, gradient, n);
}

int progress(void* descent, const double* /*phases*/, const double* gradient, double cost, double /*phases_norm*/,
             double /*gradient_norm*/, double /*step*/, int n, int /*iteration*/, int /*evaluations*/) {
  return static_cast<Descent*>(descent)->progress(gradient, cost, n);
}

PhaseStatus status_of(int result) {
  if (result == kConverged || result == LBFGS_SUCCESS || result == LBFGS_ALREADY_MINIMIZED) {
    return PhaseStatus::kConverged;
  }
  return result == LBFGSERR_MAXIMUMITERATION ? PhaseStatus::kIterationLimit : PhaseStatus::kStalled;
}

/// From the phases, which it moves.
PhaseStatus descend(Descent& descent, Eigen::VectorXd& phases, int iterations) {
  const auto n = static_cast<int>(phases.size());
  const std::unique_ptr<double, void (*)(double*)> x(lbfgs_malloc(n), lbfgs_free);  // aligned as the library asks
  if (!x) {
    throw std::bad_alloc();
  }
  Eigen::Map<Eigen::VectorXd>(x.get(), n) = phases;
  Eigen::VectorXd gradient(n);
  descent.evaluate(x.get(), gradient.data(), n);
  if (Descent::flat_here(gradient.data(), n)) {
    return PhaseStatus::kConverged;
  }
  lbfgs_parameter_t settings;
  lbfgs_parameter_init(&settings);
  settings.m = kRank;
  settings.max_iterations = iterations;
  settings.epsilon = 0.0;  // Descent ends it
  const int result = lbfgs(n, x.get(), nullptr, evaluate, progress, &descent, &settings);
  phases = Eigen::Map<const Eigen::VectorXd>(x.get(), n);
  return status_of(result);
}

}  // namespace

PhaseSolution solve_lbfgs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                          const IterationCallback& callback) {
  const Eigen::VectorXcd q = valid_start(problem, start, options, "solve_lbfgs");
  Eigen::VectorXd phases = q.cwiseArg();

  PhaseSolution solution;
  solution.cost_history.push_back(skin_cost(problem, q));
  const double unit = std::max(silent_cost(problem), solution.cost_history.front());
  if (unit > 0) {
    Descent descent(problem, unit, solution, callback);
    solution.status = descend(descent, phases, options.iterations);
    solution.iterations = static_cast<int>(solution.cost_history.size()) - 1;
  } else {
    solution.status = PhaseStatus::kConverged;  // nothing is wanted and nothing sounds
  }
  return full_drive(phases, std::move(solution));
}

}  // namespace touchfield
