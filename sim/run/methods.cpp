#include "sim/run/methods.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <stdexcept>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/field/judge.h"
#include "sim/rendering/gram.h"
#include "solvers/linear/hermitian_product.h"

namespace touchfield {

namespace {

bool iterates(MethodKind kind) { return kind == MethodKind::kPaper || kind == MethodKind::kUnscattered; }

/// Angles to start from. Drawn from the generator's bits directly: distributions differ between standard libraries.
Eigen::VectorXd start_angles(const StartSpec& start, Eigen::Index size) {
  Eigen::VectorXd angles = Eigen::VectorXd::Zero(size);
  if (start.kind == StartSpec::Kind::kRandom) {
    std::mt19937_64 generator(start.seed);
    for (Eigen::Index i = 0; i < size; ++i) {
      angles(i) = 2.0 * std::numbers::pi * std::ldexp(static_cast<double>(generator() >> 11U), -53);
    }
  }
  return angles;
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

MethodSolver::MethodSolver(SkinScattering& scattering, Eigen::Index channels, const std::optional<Target>& target)
    : scattering_(scattering), channels_(channels), target_(target) {}

PhaseSolution MethodSolver::solve(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress) {
  switch (method.kind) {
    case MethodKind::kPaper:
    case MethodKind::kUnscattered:
      return solve_incident_method(method, amplitudes, progress);
    case MethodKind::kFocus:
      // Phase conjugation: every channel arrives at the central face in phase.
      return direct_solution(-central_row().transpose().cwiseArg());
    case MethodKind::kFixed: {
      if (method.phases.size() == 1) {
        return direct_solution(Eigen::VectorXd::Constant(channels_, method.phases.front()));
      }
      return direct_solution(Eigen::Map<const Eigen::VectorXd>(method.phases.data(), channels_));
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
        method.kind == MethodKind::kUnscattered ? unscattered(amplitudes) : scattered(amplitudes);
    return solve_incident(
        problem, start_angles(method.start, problem.gram.rows()), options,
        [&](int iteration, double) { progress.advance(static_cast<double>(iteration) / method.iterations); });
  } catch (const std::invalid_argument& error) {
    throw NumericalError(fmt::format("method {}: {}", method.name, error.what()));
  }
}

const Eigen::RowVectorXcd& MethodSolver::central_row() {
  if (central_row_.size() == 0) {
    central_row_ = scattering_.transfer_rows({central_face(scattering_.system().mesh(), *target_)}, "focus");
  }
  return central_row_;
}

double MethodSolver::best_scale(const MethodSpec& method, const Wave& wave, const std::vector<TargetBox>& boxes,
                                Progress& progress) {
  const auto judged = [&](double scale) {
    const PhaseSolution trial = solve(method, scale * target_->amplitudes, progress);
    return judge(scattering_.system().mesh(), wave, boxes, *target_, scattering_.pressure(drive(trial), "scale"));
  };
  if (!iterates(method.kind)) {
    return 1.0 / judged(1.0).scale;
  }
  constexpr int kEvaluations = 9;  // narrows 1/50..1 to a factor of 1.09
  constexpr double kLowest = 0.02;
  const double largest = central_row().cwiseAbs().sum() / target_->amplitudes.maxCoeff();
  return golden_section([&](double scale) { return judged(scale).relative_error; }, kLowest * largest, largest,
                        kEvaluations);
}

}  // namespace touchfield
