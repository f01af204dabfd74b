#include "solvers/phase/phase_descent.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "solvers/linear/blas_product.h"
#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

using Eigen::VectorXcf;
using Eigen::VectorXd;

constexpr double kFirstTurn = 0.05;       // of a phase in the first step, root mean square [rad]
constexpr std::size_t kMemory = 60;       // steps: those of some six problems
constexpr double kLeastCurvature = 1e-8;  // cosine of a step and the gradient's change: below, rounding tells it

double root_mean_square(const VectorXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); }

/// Phases with what they make of the skin.
struct MappedPoint {
  VectorXd phases;
  VectorXcf drives;
  VectorXcf pressure;
  VectorXd magnitudes;  // at full drive, as the pressure
  double level = 1;
  double cost = 0;
};

/// What PhaseDescent steps on. With a free level it is the cost at each point's best level. There the cost does not
/// change with the level, so its gradient is that along the phases alone.
struct MappedCost {
  const MappedSkin& skin;
  bool free_level;

  MappedPoint at(VectorXd phases) const {
    MappedPoint point;
    point.phases = std::move(phases);
    point.drives =
        point.phases.unaryExpr([](double phase) { return std::polar(1.0, phase); }).cast<std::complex<float>>();
    point.pressure = skin.map.pressure(point.drives);
    point.magnitudes = point.pressure.cast<std::complex<double>>().cwiseAbs();
    point.level = free_level ? best_level(point) : 1.0;
    point.cost = skin.weights.dot((point.level * point.magnitudes - skin.amplitudes).cwiseAbs2()) + skin.constant;
    return point;
  }

  VectorXd gradient(const MappedPoint& point) const {
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

  PhaseSolution solution(const MappedPoint& point, PhaseSolution solution) const {
    solution = full_drive(point.phases, std::move(solution));
    solution.amplitudes.setConstant(point.level);
    return solution;
  }

  /// The common amplitude of all drives, up to 1, at which the cost is least.
  double best_level(const MappedPoint& point) const {
    const VectorXd weighted = skin.weights.cwiseProduct(point.magnitudes);
    const double energy = weighted.dot(point.magnitudes);
    return energy > 0 ? std::min(1.0, weighted.dot(skin.amplitudes) / energy) : 1.0;
  }
};

void require_sequence(const PhaseSequence& sequence, const SequenceOptions& options) {
  const Eigen::Index faces = sequence.rows.rows();
  const Eigen::Index frames = sequence.frame_count();
  if (frames == 0 || faces == 0 || sequence.amplitudes.rows() != faces || sequence.weights.rows() != faces ||
      sequence.weights.cols() != frames || static_cast<Eigen::Index>(sequence.middle.size()) != frames ||
      (sequence.outside.rows() > 0 && sequence.outside.cols() != sequence.rows.cols())) {
    throw std::invalid_argument("solve_sequence: sizes do not fit each other");
  }
  for (const Eigen::Index face : sequence.middle) {
    if (face < 0 || face >= faces) {
      throw std::invalid_argument("solve_sequence: a middle is not a row");
    }
  }
  if (options.first_iterations < 1 || options.iterations < 1 || !(options.most_turn > 0)) {
    throw std::invalid_argument("solve_sequence: an option is out of range");
  }
}

/// The rows of all faces and of R as the descent multiplies with them, in single precision.
class SequenceSkin {
 public:
  explicit SequenceSkin(const PhaseSequence& sequence)
      : sequence_(sequence), all_(sequence.rows.rows() + sequence.outside.rows(), sequence.rows.cols()) {
    all_ << sequence.rows.cast<std::complex<float>>(), sequence.outside.cast<std::complex<float>>();
  }

  MappedSkin frame(Eigen::Index frame) const {
    MappedSkin skin;
    skin.map.pressure = [this](const Eigen::VectorXcf& q) {
      Eigen::VectorXcf p(all_.rows());
      multiply(Op::kPlain, all_, q, 0.0F, p);
      return p;
    };
    skin.map.sent_back = [this](const Eigen::VectorXcf& v) {
      Eigen::VectorXcf x(all_.cols());
      multiply(Op::kAdjoint, all_, v, 0.0F, x);
      return x;
    };
    skin.amplitudes = Eigen::VectorXd::Zero(all_.rows());
    skin.weights = Eigen::VectorXd::Ones(all_.rows());
    skin.amplitudes.head(sequence_.rows.rows()) = sequence_.amplitudes.col(frame);
    skin.weights.head(sequence_.rows.rows()) = sequence_.weights.col(frame);
    return skin;
  }

 private:
  const PhaseSequence& sequence_;
  Eigen::MatrixXcf all_;
};

/// Phases that do to the next middle what these do to the last one.
Eigen::VectorXd carried(const PhaseSequence& sequence, const Eigen::VectorXd& phases, Eigen::Index from,
                        Eigen::Index to) {
  Eigen::VectorXd next = phases;
  for (Eigen::Index n = 0; n < phases.size(); ++n) {
    next(n) += std::arg(sequence.rows(from, n) * std::conj(sequence.rows(to, n)));
  }
  return next;
}

/// Within the limit of the frame before and, of a closed sequence, within reach of the first. No bounds without a
/// limit.
///
/// left   frames from this one to the first one's return
PhaseBounds bounds_of(const Eigen::VectorXd& before, const Eigen::VectorXd& first, Eigen::Index left,
                      const SequenceOptions& options) {
  if (!std::isfinite(options.most_turn)) {
    return {};
  }
  PhaseBounds bounds{before.array() - options.most_turn, before.array() + options.most_turn};
  if (options.closed) {
    const double reach = static_cast<double>(left) * options.most_turn;
    for (Eigen::Index n = 0; n < before.size(); ++n) {
      const double nearest = before(n) - std::remainder(before(n) - first(n), 2.0 * std::numbers::pi);
      bounds.low(n) = std::max(bounds.low(n), nearest - reach);
      bounds.high(n) = std::min(bounds.high(n), nearest + reach);
    }
  }
  return bounds;
}

/// The same drives as of `phases`, each phase as near to `before` as it comes by whole turns, and within the bounds.
Eigen::VectorXd nearest(const Eigen::VectorXd& phases, const Eigen::VectorXd& before, const PhaseBounds& bounds) {
  const Eigen::VectorXd near =
      before + (phases - before).unaryExpr([](double turn) { return std::remainder(turn, 2.0 * std::numbers::pi); });
  return bounds.within(near);
}

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
                                    const PhaseBounds& bounds) {
  return descend(MappedCost{skin, free_level}, start, iterations, bounds);
}

SkinProblem problem_of(const PhaseSequence& sequence, Eigen::Index frame) {
  std::vector<Eigen::Index> wanted;
  std::vector<Eigen::Index> silent;
  for (Eigen::Index j = 0; j < sequence.rows.rows(); ++j) {
    (sequence.amplitudes(j, frame) > 0 ? wanted : silent).push_back(j);
  }
  SkinProblem problem;
  problem.target = sequence.rows(wanted, Eigen::all);
  problem.amplitudes = sequence.amplitudes(wanted, frame);
  problem.weights = sequence.weights(wanted, frame);
  problem.outside.resize(sequence.outside.rows() + static_cast<Eigen::Index>(silent.size()), sequence.rows.cols());
  problem.outside << sequence.outside,
      (sequence.weights(silent, frame).cwiseSqrt().asDiagonal() * sequence.rows(silent, Eigen::all));
  return problem;
}

std::vector<PhaseSolution> solve_sequence(const PhaseSequence& sequence, const SequenceOptions& options,
                                          const IterationCallback& callback) {
  require_sequence(sequence, options);
  const SequenceSkin skin(sequence);
  PhaseDescent descent;
  std::vector<PhaseSolution> solutions;
  for (Eigen::Index k = 0; k < sequence.frame_count(); ++k) {
    if (k == 0) {
      solutions.push_back(search_surface(problem_of(sequence, 0), Eigen::MatrixXcd(sequence.rows.cols(), 0),
                                         {.iterations = options.first_iterations, .free_level = options.free_level}));
    } else {
      const Eigen::VectorXd& before = solutions.back().phases;
      const Eigen::VectorXd start = carried(sequence, before, sequence.middle[static_cast<std::size_t>(k - 1)],
                                            sequence.middle[static_cast<std::size_t>(k)]);
      const PhaseBounds bounds = bounds_of(before, solutions.front().phases, sequence.frame_count() - k, options);
      solutions.push_back(descent.descend(skin.frame(k), nearest(start, before, bounds), options.iterations,
                                          options.free_level, bounds));
    }
    if (callback) {
      callback(static_cast<int>(k) + 1, solutions.back().cost_history.back());
    }
  }
  return solutions;
}

}  // namespace touchfield
