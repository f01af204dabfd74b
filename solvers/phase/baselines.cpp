#include "solvers/phase/baselines.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/factorisations.h"
#include "solvers/phase/phase_descent.h"
#include "solvers/phase/skin_jacobian.h"

namespace touchfield {

namespace {

constexpr double kStill = 1e-10;       // a drive that moves by less has stopped
constexpr double kFaintest = 1e-3;     // |u_j| / p'_j over its mean: a fainter point's weight grows no faster
constexpr double kLeastWeight = 1e-6;  // over the mean: what a weight can come back from
constexpr double kLargestBoost = 1e3;  // of a point in GS-PAT's last step
constexpr double kFlat = 1e-10;        // of lbfgs: share by which a step lowers the cost, and gradient over the unit
constexpr double kMostTurn = 1.0;      // of its phases in a step, root mean square [rad]

/// Throws as require_valid, and std::invalid_argument unless iterations >= 1; `who` begins the message.
void require_valid(const SkinProblem& problem, const BaselineOptions& options, const std::string& who) {
  require_valid(problem, who.c_str());
  if (options.iterations < 1) {
    throw std::invalid_argument(who + ": iterations must be >= 1");
  }
}

/// The phases of a start as unit phasors, 1 where a drive is 0.
///
/// throws   as require_valid, and std::invalid_argument on another size or a value that is not finite
Eigen::VectorXcd valid_start(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                             const std::string& who) {
  require_valid(problem, options, who);
  if (start.size() != problem.channel_count() || !start.allFinite()) {
    throw std::invalid_argument(who + ": the start must hold one finite drive for each channel");
  }
  return phasors_of(start);
}

/// sum_n |h_jn|^2 of each target face.
Eigen::VectorXd target_energy(const SkinProblem& problem) { return problem.target.rowwise().squaredNorm(); }

/// The weights v_j p'_j of the points; constant for gs.
class PointWeights {
 public:
  PointWeights(const SkinProblem& problem, bool evened)
      : wanted_((target_energy(problem).array() > 0).select(problem.face_means(), 0.0)),
        evened_(evened),
        weights_(Eigen::VectorXd::Ones(wanted_.size())) {}

  Eigen::VectorXd next(const Eigen::VectorXcd& u) {
    if (evened_) {
      even_out(u);
    }
    return weights_.cwiseProduct(wanted_);
  }

 private:
  void even_out(const Eigen::VectorXcd& u) {
    const auto points = (wanted_.array() > 0).count();
    const Eigen::ArrayXd share = (wanted_.array() > 0).select(u.array().abs() / wanted_.array(), 0.0);
    const double mean = share.sum() / static_cast<double>(points);
    if (!(mean > 0)) {
      return;
    }
    weights_ = (wanted_.array() > 0).select(weights_.array() * mean / share.max(kFaintest * mean), 0.0);
    weights_ /= weights_.sum() / static_cast<double>(points);
    weights_ = (wanted_.array() > 0).select(weights_.array().max(kLeastWeight), 0.0);
  }

  Eigen::VectorXd wanted_;  // p', 0 where the face cannot be reached
  bool evened_;
  Eigen::VectorXd weights_;
};

PhaseSolution exchanged(const SkinProblem& problem, Eigen::VectorXcd q, PointWeights weights,
                        const BaselineOptions& options, const IterationCallback& callback) {
  SkinField field;
  send(problem, q, field);
  PhaseSolution solution;
  solution.status = PhaseStatus::kIterationLimit;
  solution.cost_history.push_back(field_cost(problem, field));
  SkinField back{field.target, Eigen::VectorXcd::Zero(field.outside.size())};
  Eigen::VectorXcd returned;
  iterate(solution, options.iterations, callback, [&](PhaseStatus& status) {
    const Eigen::VectorXd levels = weights.next(field.target);
    for (Eigen::Index j = 0; j < levels.size(); ++j) {
      back.target(j) = levels(j) * phasor(field.target(j));
    }
    send_back(problem, back, returned);
    double largest_move = 0.0;
    for (Eigen::Index n = 0; n < q.size(); ++n) {
      const std::complex<double> next = phasor(returned(n), q(n));
      largest_move = std::max(largest_move, std::abs(next - q(n)));
      q(n) = next;
    }
    send(problem, q, field);
    status = largest_move <= kStill ? PhaseStatus::kConverged : status;
    return field_cost(problem, field);
  });
  return full_drive(q.cwiseArg(), std::move(solution));
}

constexpr double kLeastPrice = 1e-12;  // s_n^2 over its largest

/// The faces that take part.
std::vector<Eigen::Index> points_of(const SkinProblem& problem, const Eigen::VectorXd& energy) {
  std::vector<Eigen::Index> points;
  for (Eigen::Index j = 0; j < energy.size(); ++j) {
    if (energy(j) > 0 && problem.amplitudes(j) > 0) {
      points.push_back(j);
    }
  }
  return points;
}

/// The phases of the dominant eigenvector of H H^H D as phasors: D^(1/2) times it is the dominant eigenvector of the
/// Hermitian D^(1/2) H H^H D^(1/2).
Eigen::VectorXcd point_phasors(const Eigen::MatrixXcd& h, const Eigen::VectorXd& d) {
  const Eigen::MatrixXcd mutual = hermitian_product(h.adjoint() * d.cwiseSqrt().asDiagonal());
  const Eigen::VectorXcd dominant = hermitian_eigen(mutual).vectors.rightCols(1);
  return phasors_of(dominant);
}

/// skin_cost over the phases, in units in which a tolerance on the gradient has a meaning.
class PricedSkin {
 public:
  struct Point {
    Eigen::VectorXd phases;
    Eigen::VectorXcd phasors;
    SkinField field;
    double cost = 0;
  };

  PricedSkin(const SkinProblem& problem, double unit) : problem_(problem), unit_(unit), jacobian_(problem) {}

  Point at(Eigen::VectorXd phases) const {
    Point point{std::move(phases), {}, {}};
    point.phasors = point.phases.unaryExpr([](double phase) { return std::polar(1.0, phase); });
    send(problem_, point.phasors, point.field);
    point.cost = field_cost(problem_, point.field) / unit_;
    return point;
  }

  Eigen::VectorXd gradient(const Point& point) const {
    jacobian_.set(point.field, point.phasors);
    Eigen::VectorXd half;
    jacobian_.gradient(half);
    return (2.0 / unit_) * half;
  }

 private:
  const SkinProblem& problem_;
  double unit_;
  mutable SkinJacobian jacobian_;
};

}  // namespace

PhaseSolution solve_gs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                       const IterationCallback& callback) {
  const Eigen::VectorXcd q = valid_start(problem, start, options, "solve_gs");
  return exchanged(problem, q, {problem, false}, options, callback);
}

PhaseSolution solve_wgs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                        const IterationCallback& callback) {
  const Eigen::VectorXcd q = valid_start(problem, start, options, "solve_wgs");
  return exchanged(problem, q, {problem, true}, options, callback);
}

PhaseSolution solve_gs_pat(const SkinProblem& problem, const BaselineOptions& options) {
  require_valid(problem, options, "solve_gs_pat");
  const Eigen::VectorXd energy = target_energy(problem);
  const Eigen::VectorXd share = (energy.array() > 0).select(energy.array().inverse(), 0.0);
  const Eigen::VectorXd wanted = (energy.array() > 0).select(problem.face_means(), 0.0);
  const Eigen::MatrixXcd mutual = hermitian_product(problem.target.adjoint()) * share.asDiagonal();

  PhaseSolution solution;
  solution.status = PhaseStatus::kIterationLimit;
  Eigen::VectorXcd points = wanted.cast<std::complex<double>>();
  Eigen::VectorXcd reached = mutual * points;
  while (solution.status == PhaseStatus::kIterationLimit && solution.iterations < options.iterations) {
    ++solution.iterations;
    bool still = true;
    for (Eigen::Index j = 0; j < points.size(); ++j) {
      const std::complex<double> next = wanted(j) * phasor(reached(j));
      still = still && std::abs(next - points(j)) <= kStill * wanted(j);
      points(j) = next;
    }
    reached = mutual * points;
    if (still) {
      solution.status = PhaseStatus::kConverged;
    }
  }
  SkinField back{Eigen::VectorXcd(points.size()), Eigen::VectorXcd::Zero(problem.outside.rows())};
  for (Eigen::Index j = 0; j < points.size(); ++j) {
    const double boosted = wanted(j) * wanted(j) / std::max(std::abs(reached(j)), wanted(j) / kLargestBoost);
    back.target(j) = wanted(j) > 0 ? share(j) * boosted * phasor(reached(j)) : 0.0;
  }
  Eigen::VectorXcd q;
  send_back(problem, back, q);
  return full_drive(q.cwiseArg(), std::move(solution));
}

PhaseSolution solve_eigen(const SkinProblem& problem) {
  require_valid(problem, "solve_eigen");
  const Eigen::VectorXd energy = target_energy(problem);
  const std::vector<Eigen::Index> points = points_of(problem, energy);
  if (points.empty()) {
    return full_drive(Eigen::VectorXd::Zero(problem.channel_count()));
  }
  const Eigen::MatrixXcd h = problem.target(points, Eigen::all);
  const Eigen::VectorXd amplitudes = problem.face_means()(points);
  Eigen::VectorXd price = h.cwiseAbs().transpose() * amplitudes / static_cast<double>(h.rows());
  price = price.cwiseMax(kLeastPrice * price.maxCoeff()).eval();

  // In the points' K x K system: q = S^-1 H^H (H S^-1 H^H + I)^-1 p' e^{i theta}, S = diag(s_n^2).
  const Eigen::MatrixXcd priced = price.cwiseSqrt().cwiseInverse().asDiagonal() * h.adjoint();
  Eigen::MatrixXcd system = hermitian_product(priced);
  system.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXcd> factors(system);
  if (factors.info() != Eigen::Success) {
    throw std::domain_error("solve_eigen: the regularised system is singular to rounding");
  }
  const Eigen::VectorXcd wanted = amplitudes.cwiseProduct(point_phasors(h, amplitudes.cwiseQuotient(energy(points))));
  const Eigen::VectorXcd q = price.cwiseInverse().asDiagonal() * (h.adjoint() * factors.solve(wanted));
  return full_drive(q.cwiseArg());
}

PhaseSolution solve_lbfgs(const SkinProblem& problem, const Eigen::VectorXcd& start, const BaselineOptions& options,
                          const IterationCallback& callback) {
  const Eigen::VectorXcd q = valid_start(problem, start, options, "solve_lbfgs");
  PhaseSolution solution;
  solution.status = PhaseStatus::kConverged;
  solution.cost_history.push_back(skin_cost(problem, q));
  const double unit = std::max(silent_cost(problem), solution.cost_history.front());
  if (!(unit > 0)) {
    return full_drive(q.cwiseArg(), std::move(solution));  // nothing is wanted and nothing sounds
  }
  const PricedSkin skin(problem, unit);
  PricedSkin::Point point = skin.at(q.cwiseArg());
  Eigen::VectorXd gradient = skin.gradient(point);
  const auto is_flat = [&] { return gradient.cwiseAbs().maxCoeff() <= kFlat; };
  solution.status = is_flat() ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
  PhaseDescent descent(kMostTurn);
  iterate(solution, options.iterations, callback, [&](PhaseStatus& status) {
    const double before = point.cost;
    const PhaseDescent::Step step = descent.step(skin, point, gradient);
    if (is_flat() || (step == PhaseDescent::Step::kTaken && before - point.cost <= kFlat * before)) {
      status = PhaseStatus::kConverged;
    } else if (step == PhaseDescent::Step::kNone) {
      status = PhaseStatus::kStalled;
    }
    return point.cost * unit;
  });
  return full_drive(point.phases, std::move(solution));
}

}  // namespace touchfield
