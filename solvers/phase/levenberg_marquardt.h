#pragma once

#include <algorithm>
#include <cmath>

#include "solvers/phase/phase_solution.h"

namespace touchfield {

/// Madsen's damping of Levenberg-Marquardt: an accepted step multiplies mu by max(1/3, 1 - (2 gain - 1)^3) and sets
/// nu = 2; a rejected one multiplies mu by nu and doubles nu.
///
/// source   Madsen, Nielsen, Tingleff, Methods for Non-Linear Least Squares Problems, 2004, ch. 3.2
class MadsenDamping {
 public:
  /// first   mu_0; 1 in its place where it is not > 0
  /// least   of mu after a rejected step
  explicit MadsenDamping(double first, double least = 0.0)
      : mu_(first > 0 ? first : 1.0), least_(least), largest_(1e30 * mu_) {}

  double value() const { return mu_; }

  /// gain   fall of the cost over the fall that the linear model predicted; below 0 and NaN count as 0
  void accept(double gain) {
    mu_ *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * std::max(0.0, gain) - 1.0, 3));
    nu_ = 2.0;
  }

  void reject() {
    mu_ = std::max(nu_ * mu_, least_);
    nu_ *= 2.0;
  }

  /// Beyond 1e30 times the first value: no step helps.
  bool exhausted() const { return !(mu_ < largest_); }

 private:
  double mu_;
  double least_;
  double largest_;
  double nu_ = 2.0;
};

/// What follows a step that does not lower the cost.
enum class Refusal {
  kDamp,       // more damping
  kSameAgain,  // another step at the same damping
  kAtRest,     // nothing: the cost cannot be told from its minimum's
};

/// One step of Levenberg-Marquardt, tried: the only such loop, whatever is fitted. Problem has
///
///   bool solve(double mu)   finds the step at damping mu and what it leads to; false where there is none
///   bool lowers_cost()      whether that is better
///   double accept()         goes there and linearises; returns the gain ratio, see MadsenDamping
///   bool rests()            whether the step accepted last is the end
///   Refusal refuse()        a step that does not lower the cost
///
/// returns   kIterationLimit: to be continued
template <class Problem>
PhaseStatus try_step(Problem& problem, MadsenDamping& damping) {
  const bool found = problem.solve(damping.value());
  if (found && problem.lowers_cost()) {
    damping.accept(problem.accept());
    return problem.rests() ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
  }
  const Refusal refusal = found ? problem.refuse() : Refusal::kDamp;
  if (refusal != Refusal::kDamp) {
    return refusal == Refusal::kAtRest ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
  }
  damping.reject();
  return damping.exhausted() ? PhaseStatus::kStalled : PhaseStatus::kIterationLimit;
}

}  // namespace touchfield
