#pragma once

#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// A matrix H of M rows that is known by its products, in single precision.
struct SkinMap {
  std::function<Eigen::VectorXcf(const Eigen::VectorXcf& q)> pressure;   // H q, M
  std::function<Eigen::VectorXcf(const Eigen::VectorXcf& v)> sent_back;  // H^H v, N
};

/// The misfit of amplitudes on all faces, p = H q, known by products with H alone:
///
///   cost(q) = sum_j w_j (|p_j| - p'_j)^2 + c
///
/// It is skin_cost with the faces outside among the M faces, p'_j = 0 and w_j = w_Z A_j there. A face of which a share
/// s belongs to the target counts as one: with w_j = (s + w_Z (1 - s)) A_j and p'_j = s A_j p' / w_j,
///
///   s A (|p| - p')^2 + w_Z (1 - s) A |p|^2 = w_j (|p| - p'_j)^2 + s A p'^2 - w_j p'_j^2
struct MappedSkin {
  SkinMap map;
  Eigen::VectorXd amplitudes;  // p', M [Pa], >= 0
  Eigen::VectorXd weights;     // w, M, >= 0
  double constant = 0.0;       // c
};

/// Bounds of phases [rad], N each; empty: there are none.
struct PhaseBounds {
  Eigen::VectorXd low;
  Eigen::VectorXd high;

  Eigen::VectorXd within(const Eigen::VectorXd& phases) const {
    return low.size() == 0 ? phases : Eigen::VectorXd(phases.cwiseMax(low).cwiseMin(high));
  }
};

/// Limited-memory BFGS over phases. Its memory of 60 steps may serve a sequence of problems that change little from one
/// to the next, as those of a body that moves. Each step halves until the cost falls (Armijo).
///
/// source   Nocedal, Math. Comp. 35 (1980) 773
class PhaseDescent {
 public:
  /// most_turn   of phases in a step, root mean square [rad]
  explicit PhaseDescent(double most_turn = 0.3) : most_turn_(most_turn) {}

  /// Steps from these phases, N. One step takes a product with H for each trial, 1.1 on average, and one with H^H.
  ///
  /// start        within the bounds
  /// free_level   whether all drives have, at each step, the amplitude up to 1 at which the cost is least; else it is 1
  /// pressure     gets H q of the solution, M; may be null
  /// throws       std::domain_error if the cost at the start is not finite
  PhaseSolution descend(const MappedSkin& skin, const Eigen::VectorXd& start, int iterations, bool free_level,
                        const PhaseBounds& bounds = {}, Eigen::VectorXcf* pressure = nullptr);

  /// The same on any problem with points and gradients as `step` takes them; problem.solution(point, solution) fills in
  /// phases and amplitudes.
  ///
  /// standstill   converged if six steps together lower the cost by less than this share of it
  /// end          gets the point of the solution; may be null
  template <class Problem>
  PhaseSolution descend(const Problem& problem, const Eigen::VectorXd& start, int iterations,
                        const PhaseBounds& bounds = {}, double standstill = 0.0, const IterationCallback& callback = {},
                        typename Problem::Point* end = nullptr) {
    constexpr std::size_t kSteps = 6;
    auto point = problem.at(start);
    if (!std::isfinite(point.cost)) {
      throw std::domain_error("phase descent: the pressure is not finite");
    }
    Eigen::VectorXd gradient = problem.gradient(point);
    PhaseSolution solution;
    solution.status = PhaseStatus::kIterationLimit;
    solution.cost_history.push_back(point.cost);
    iterate(solution, iterations, callback, [&](PhaseStatus& status) {
      const std::vector<double>& costs = solution.cost_history;
      if (step(problem, point, gradient, bounds) == Step::kNone) {
        status = PhaseStatus::kStalled;
      } else if (costs.size() >= kSteps && costs[costs.size() - kSteps] - point.cost < standstill * point.cost) {
        status = PhaseStatus::kConverged;
      }
      return point.cost;
    });
    solution = problem.solution(point, std::move(solution));
    if (end != nullptr) {
      *end = std::move(point);
    }
    return solution;
  }

  enum class Step { kTaken, kForgot, kNone };  // kForgot: none along what the memory said, which is empty now

  /// One step.
  ///
  /// problem    problem.at(phases) is a point with phases and cost, problem.gradient(point) the gradient there
  /// gradient   at the point, both are moved
  template <class Problem, class Point>
  Step step(const Problem& problem, Point& point, Eigen::VectorXd& gradient, const PhaseBounds& bounds = {}) {
    constexpr double kSufficient = 1e-4;  // of the fall that the slope promises
    constexpr int kTrials = 8;
    const Eigen::VectorXd d = direction(gradient);
    double share = 1.0;
    for (int trial = 0; trial < kTrials; ++trial, share *= 0.5) {
      const Eigen::VectorXd move = bounds.within(point.phases + share * d) - point.phases;
      const double slope = gradient.dot(move);
      if (!(slope < 0)) {
        break;
      }
      Point candidate = problem.at(point.phases + move);
      if (candidate.cost <= point.cost + kSufficient * slope) {
        point = std::move(candidate);
        Eigen::VectorXd next = problem.gradient(point);
        remember(move, next - gradient);
        gradient = std::move(next);
        return Step::kTaken;
      }
    }
    const bool remembered = !memory_.empty();
    memory_.clear();  // what it says does not hold here
    return remembered ? Step::kForgot : Step::kNone;
  }

 private:
  Eigen::VectorXd direction(const Eigen::VectorXd& gradient) const;
  void remember(Eigen::VectorXd step, Eigen::VectorXd change);

  struct Pair {
    Eigen::VectorXd step;
    Eigen::VectorXd change;  // of the gradient
    double product;          // of both, > 0
  };
  double most_turn_;
  std::deque<Pair> memory_;
};

}  // namespace touchfield
