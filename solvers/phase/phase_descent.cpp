#include "solvers/phase/phase_descent.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <utility>
#include <vector>

#include "solvers/phase/skin_field.h"

namespace touchfield {

namespace {

using Eigen::VectorXcf;
using Eigen::VectorXd;

constexpr std::size_t kMemory = 60;       // pairs: those of some six problems
constexpr double kFirstTurn = 0.05;       // of a phase in the first step, root mean square [rad]
constexpr double kMostTurn = 0.3;         // in any step
constexpr double kSufficient = 1e-4;      // of the fall that the slope promises
constexpr double kLeastCurvature = 1e-8;  // cosine of a step and the gradient's change: below, rounding tells it
constexpr int kTrials = 8;

double root_mean_square(const VectorXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); }

/// Phases with what they make of the skin.
struct DescentPoint {
  VectorXd phases;
  VectorXcf drives;
  VectorXcf pressure;
  double cost = 0;

  DescentPoint(const MappedSkin& skin, VectorXd at) : phases(std::move(at)) {
    drives = phases.unaryExpr([](double phase) { return std::polar(1.0, phase); }).cast<std::complex<float>>();
    pressure = skin.pressure(drives);
    cost = cost_at(skin, 1.0);
  }

  double cost_at(const MappedSkin& skin, double level) const {
    const VectorXd misfit = level * magnitudes() - skin.amplitudes;
    return skin.weights.dot(misfit.cwiseAbs2());
  }

  /// The common amplitude of all drives, up to 1, at which the cost is least.
  double best_level(const MappedSkin& skin) const {
    const VectorXd weighted = skin.weights.cwiseProduct(magnitudes());
    const double energy = weighted.dot(magnitudes());
    return energy > 0 ? std::min(1.0, weighted.dot(skin.amplitudes) / energy) : 1.0;
  }

  VectorXd magnitudes() const { return pressure.cast<std::complex<double>>().cwiseAbs(); }

  VectorXd gradient(const MappedSkin& skin) const {
    VectorXcf v(pressure.size());
    for (Eigen::Index j = 0; j < v.size(); ++j) {
      const std::complex<double> p = pressure(j);
      const double magnitude = std::abs(p);
      // Where there is silence any direction of the pressure leaves it.
      const std::complex<double> direction = magnitude > 0 ? p / magnitude : 1.0;
      v(j) = std::complex<float>(skin.weights(j) * (magnitude - skin.amplitudes(j)) * direction);
    }
    const VectorXcf back = skin.sent_back(v);
    return 2.0 * (drives.conjugate().cwiseProduct(back)).imag().cast<double>();
  }
};

}  // namespace

/// Without bounds all moves are within them.
VectorXd PhaseDescent::within(const PhaseBounds& bounds, const VectorXd& phases) {
  return bounds.low.size() == 0 ? phases : VectorXd(phases.cwiseMax(bounds.low).cwiseMin(bounds.high));
}

/// The two loops of the memory, newest first and back; d = -g where there is none.
VectorXd PhaseDescent::direction(const VectorXd& gradient) const {
  VectorXd d = -gradient;
  if (memory_.empty()) {
    return d * (kFirstTurn / std::max(root_mean_square(d), 1e-300));
  }
  std::vector<double> shares(memory_.size());
  for (std::size_t i = memory_.size(); i-- > 0;) {
    shares[i] = memory_[i].step.dot(d) / memory_[i].product;
    d -= shares[i] * memory_[i].change;
  }
  d *= memory_.back().product / memory_.back().change.squaredNorm();
  for (std::size_t i = 0; i < memory_.size(); ++i) {
    d += (shares[i] - memory_[i].change.dot(d) / memory_[i].product) * memory_[i].step;
  }
  return d * std::min(1.0, kMostTurn / std::max(root_mean_square(d), 1e-300));
}

void PhaseDescent::remember(VectorXd step, VectorXd change) {
  const double product = step.dot(change);
  if (product > kLeastCurvature * step.norm() * change.norm()) {
    memory_.push_back({std::move(step), std::move(change), product});
  }
  if (memory_.size() > kMemory) {
    memory_.pop_front();
  }
}

PhaseSolution PhaseDescent::descend(const MappedSkin& skin, const VectorXd& start, int iterations, bool free_level,
                                    const PhaseBounds& bounds) {
  DescentPoint point(skin, start);
  if (!std::isfinite(point.cost)) {
    throw std::domain_error("phase descent: the pressure is not finite");
  }
  VectorXd gradient = point.gradient(skin);
  PhaseSolution solution;
  solution.status = PhaseStatus::kIterationLimit;
  solution.cost_history.push_back(point.cost);
  iterate(solution, iterations, {}, [&](PhaseStatus& status) {
    const VectorXd d = direction(gradient);
    double share = 1.0;
    for (int trial = 0; trial < kTrials; ++trial, share *= 0.5) {
      const VectorXd move = within(bounds, point.phases + share * d) - point.phases;
      const double slope = gradient.dot(move);
      if (!(slope < 0)) {
        break;
      }
      DescentPoint candidate(skin, point.phases + move);
      if (candidate.cost <= point.cost + kSufficient * slope) {
        VectorXd next = candidate.gradient(skin);
        remember(move, next - gradient);
        gradient = std::move(next);
        point = std::move(candidate);
        return point.cost;
      }
    }
    status = memory_.empty() ? PhaseStatus::kStalled : PhaseStatus::kIterationLimit;
    memory_.clear();  // what it says does not hold here
    return point.cost;
  });
  solution = full_drive(point.phases, std::move(solution));
  if (free_level) {
    const double level = point.best_level(skin);
    solution.amplitudes.setConstant(level);
    solution.cost_history.back() = point.cost_at(skin, level);
  }
  return solution;
}

}  // namespace touchfield
