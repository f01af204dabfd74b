#include "solvers/phase/phase_descent.h"

#include <algorithm>
#include <complex>

#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

using Eigen::VectorXcf;
using Eigen::VectorXd;

constexpr double kFirstTurn = 0.05;       // of a phase in the first step, root mean square [rad]
constexpr std::size_t kMemory = 60;       // steps: those of some six problems
constexpr double kLeastCurvature = 1e-8;  // cosine of a step and the gradient's change: below, rounding tells it

double root_mean_square(const VectorXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); }

/// What PhaseDescent steps on. With a free level it is the cost at each point's best level. There the cost does not
/// change with the level, so its gradient is that along the phases alone.
struct MappedCost {
  struct Point {
    VectorXd phases;
    VectorXcf drives;
    VectorXcf pressure;
    VectorXd magnitudes;  // at full drive, as the pressure
    double level = 1;
    double cost = 0;
  };

  const MappedSkin& skin;
  bool free_level;

  Point at(VectorXd phases) const {
    Point point;
    point.phases = std::move(phases);
    point.drives =
        point.phases.unaryExpr([](double phase) { return std::polar(1.0, phase); }).cast<std::complex<float>>();
    point.pressure = skin.map.pressure(point.drives);
    point.magnitudes = point.pressure.cast<std::complex<double>>().cwiseAbs();
    point.level = free_level ? best_level(point) : 1.0;
    point.cost = skin.weights.dot((point.level * point.magnitudes - skin.amplitudes).cwiseAbs2()) + skin.constant;
    return point;
  }

  VectorXd gradient(const Point& point) const {
    VectorXcf v(point.pressure.size());
    for (Eigen::Index j = 0; j < v.size(); ++j) {
      const double magnitude = point.magnitudes(j);
      // Where there is silence any direction of the pressure leaves it.
      const std::complex<double> direction =
          magnitude > 0 ? std::complex<double>(point.pressure(j)) / magnitude : std::complex<double>(1.0);
      const double misfit = point.level * magnitude - skin.amplitudes(j);
      v(j) = std::complex<float>(point.level * skin.weights(j) * misfit * direction);
    }
    return 2.0 * (point.drives.conjugate().cwiseProduct(skin.map.sent_back(v))).imag().cast<double>();
  }

  PhaseSolution solution(const Point& point, PhaseSolution solution) const {
    solution = full_drive(point.phases, std::move(solution));
    solution.amplitudes.setConstant(point.level);
    return solution;
  }

  /// The common amplitude of all drives, up to 1, at which the cost is least.
  double best_level(const Point& point) const {
    const VectorXd weighted = skin.weights.cwiseProduct(point.magnitudes);
    const double energy = weighted.dot(point.magnitudes);
    return energy > 0 ? std::min(1.0, weighted.dot(skin.amplitudes) / energy) : 1.0;
  }
};

}  // namespace

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
  return d * std::min(1.0, most_turn_ / std::max(root_mean_square(d), 1e-300));
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
                                    const PhaseBounds& bounds, VectorXcf* pressure) {
  MappedCost::Point end;
  PhaseSolution solution = descend(MappedCost{skin, free_level}, start, iterations, bounds, 0.0, {}, &end);
  if (pressure != nullptr) {
    *pressure = static_cast<float>(end.level) * end.pressure;
  }
  return solution;
}

}  // namespace touchfield
