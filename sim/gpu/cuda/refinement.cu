#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/gpu/cuda/refinement.cuh"

namespace touchfield::cuda {

namespace {

constexpr double kLeastProgress = 0.5;  // share of the worst residual a round may leave

}  // namespace

BlockRefinement::BlockRefinement(Context& context)
    : block_(context), directions_(context), correction_(context), candidate_(context) {}

RefinementReport BlockRefinement::solve(const BlockProduct& exact, const BlockProduct& approximate_inverse, int n,
                                        int columns, const cuComplex* b, cuComplex* x, const RefinementLimits& limits,
                                        bool x_is_start) {
  if (!(limits.tolerance > 0.0) || limits.max_rounds < 0) {
    throw std::invalid_argument("refine: tolerance must be > 0 and max_rounds >= 0");
  }
  RefinementReport result;
  result.residuals.assign(static_cast<std::size_t>(columns), 0.0);
  std::vector<Slot> active;
  if (n > 0 && columns > 0) {
    active = block_.start("refine", n, columns, b, x, x_is_start);
  }
  const std::size_t size = static_cast<std::size_t>(n) * active.size();
  directions_.resize(size);
  correction_.resize(size);
  candidate_.resize(size);
  for (Slot& slot : active) {
    result.residuals[static_cast<std::size_t>(slot.column)] = 1.0;
    slot.residual = x_is_start ? std::numeric_limits<double>::infinity() : 1.0;
  }

  // x <- x + correction where that is better
  const auto move = [&](const cuComplex* correction) {
    block_.correct(n, x, correction, candidate_.data());
    exact(candidate_.data(), correction_.data(), static_cast<int>(active.size()));
    block_.judge(n, b, correction_.data(), candidate_.data(), x, directions_.data());
    const std::vector<ColumnStatus>& said = block_.wait();
    for (std::size_t i = 0; i < active.size(); ++i) {
      if (!std::isfinite(said[i].value)) {
        throw std::domain_error("refine: a correction or a product holds a value that is not finite");
      }
      active[i].residual = std::min(active[i].residual, said[i].value);
      result.residuals[static_cast<std::size_t>(active[i].column)] = active[i].residual;
    }
  };
  // What is left to do, and the worst residual.
  const auto select = [&] {
    drop(active, [&](const Slot& slot) { return slot.residual <= limits.tolerance; });
    if (!active.empty()) {
      block_.upload(active);
      block_.compact(n, directions_.data());
    }
    return result.residuals.empty() ? 0.0 : *std::max_element(result.residuals.begin(), result.residuals.end());
  };

  if (!active.empty()) {
    block_.upload(active);
    if (x_is_start) {
      move(nullptr);
    } else {
      block_.judge(n, b, nullptr, nullptr, x, directions_.data());
    }
  }
  result.worst = select();
  const int first = x_is_start ? 1 : 0;
  for (int round = first; !active.empty() && round <= limits.max_rounds; ++round) {
    approximate_inverse(directions_.data(), correction_.data(), static_cast<int>(active.size()));
    move(correction_.data());
    result.rounds = round;
    const double before = result.worst;
    result.worst = select();
    if (round > 0 && result.worst > kLeastProgress * before) {
      break;
    }
  }
  result.converged = active.empty();
  return result;
}

}  // namespace touchfield::cuda
