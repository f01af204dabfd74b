#include "solvers/phase/phase_sequence.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include "solvers/phase/phase_descent.h"
#include "solvers/phase/skin_rows.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

void require_sequence(const PhaseSequence& sequence, const SequenceOptions& options) {
  const Eigen::Index faces = sequence.rows.rows();
  const Eigen::Index frames = sequence.frame_count();
  if (frames == 0 || faces == 0 || sequence.amplitudes.rows() != faces || sequence.weights.rows() != faces ||
      sequence.weights.cols() != frames || static_cast<Eigen::Index>(sequence.middle.size()) != frames ||
      (!sequence.radiation.empty() && static_cast<Eigen::Index>(sequence.radiation.size()) != frames) ||
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

/// The problem of a frame on the rows of all faces and of R.
MappedSkin frame_skin(const PhaseSequence& sequence, const SkinMap& map, Eigen::Index frame) {
  const Eigen::Index faces = sequence.rows.rows();
  const Eigen::Index all = faces + sequence.outside.rows();
  MappedSkin skin{map, Eigen::VectorXd::Zero(all), Eigen::VectorXd::Ones(all)};
  skin.amplitudes.head(faces) = sequence.amplitudes.col(frame);
  skin.weights.head(faces) = sequence.weights.col(frame);
  return skin;
}

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

/// Whether a frame wants less than half of what it wants where the frame before wanted sound too.
bool jumps(const PhaseSequence& sequence, Eigen::Index frame) {
  const auto wanted = [&](Eigen::Index k) { return sequence.weights.col(k).cwiseProduct(sequence.amplitudes.col(k)); };
  return wanted(frame).cwiseMin(wanted(frame - 1)).sum() < 0.5 * wanted(frame).sum();
}

/// The same drives as of `phases`, each phase as near to `before` as it comes by whole turns, and within the bounds.
Eigen::VectorXd nearest(const Eigen::VectorXd& phases, const Eigen::VectorXd& before, const PhaseBounds& bounds) {
  const Eigen::VectorXd near =
      before + (phases - before).unaryExpr([](double turn) { return std::remainder(turn, 2.0 * std::numbers::pi); });
  return bounds.within(near);
}

}  // namespace

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

RadiationProblem radiation_of(const PhaseSequence& sequence, Eigen::Index frame) {
  return {
      .rows = sequence.rows, .outside = sequence.outside, .skin = sequence.radiation[static_cast<std::size_t>(frame)]};
}

PhaseSolution solve_alone(const PhaseSequence& sequence, Eigen::Index frame, int iterations, bool free_level) {
  if (sequence.radiation.empty()) {
    return search_surface(problem_of(sequence, frame), Eigen::MatrixXcd(sequence.rows.cols(), 0),
                          {.iterations = iterations, .free_level = free_level});
  }
  const RadiationProblem problem = radiation_of(sequence, frame);
  return solve_radiation(problem, radiation_starts(problem), {.free_level = free_level});
}

std::vector<PhaseSolution> solve_sequence(const PhaseSequence& sequence, const SequenceOptions& options,
                                          const IterationCallback& callback) {
  require_sequence(sequence, options);
  const SkinRows rows(sequence.rows, sequence.outside);
  const SkinMap map = rows.map();
  PhaseDescent descent;
  std::vector<PhaseSolution> solutions;
  for (Eigen::Index k = 0; k < sequence.frame_count(); ++k) {
    if (k == 0) {
      solutions.push_back(solve_alone(sequence, 0, options.first_iterations, options.free_level));
    } else {
      const Eigen::VectorXd& before = solutions.back().phases;
      const Eigen::VectorXd start = carried(sequence, before, sequence.middle[static_cast<std::size_t>(k - 1)],
                                            sequence.middle[static_cast<std::size_t>(k)]);
      const PhaseBounds bounds = bounds_of(before, solutions.front().phases, sequence.frame_count() - k, options);
      const Eigen::VectorXd from = nearest(start, before, bounds);
      const int iterations =
          jumps(sequence, k) ? std::max(options.iterations, options.first_iterations) : options.iterations;
      solutions.push_back(
          sequence.radiation.empty()
              ? descent.descend(frame_skin(sequence, map, k), from, iterations, options.free_level, bounds)
              : descent.descend(
                    RadiationMisfit(map, sequence.radiation[static_cast<std::size_t>(k)], options.free_level), from,
                    iterations, bounds));
    }
    if (callback) {
      callback(static_cast<int>(k) + 1, solutions.back().cost_history.back());
    }
  }
  return solutions;
}

}  // namespace touchfield
