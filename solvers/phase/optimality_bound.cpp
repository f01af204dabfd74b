#include "solvers/phase/optimality_bound.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <cblas.h>

#include "solvers/linear/blas_product.h"
#include "solvers/phase/dual_proof.h"
#include "solvers/phase/relaxation.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;

constexpr double kFirstShift = 0.1;   // of S, in units of the cost of silence over N
constexpr double kCoarsest = 1e-3;    // of the rows, where what they can do hardly changes the cost
constexpr double kLeastBound = 1e-4;  // of the cost of silence: the tolerance is a share of no less

/// The problem in units in which the cost of silence is 1, with its constant part apart.
struct ScaledProblem {
  MatrixXcd columns;      // A^T, N x m: first the rows that want a level, then those that want silence, R last
  VectorXd energies;      // squared norms of the columns
  VectorXd wanted;        // b, of the first, > 0
  double unit = 0.0;      // of the cost; 0 where nothing can sound
  double constant = 0.0;  // of levels that nothing reaches

  Index channel_count() const { return columns.rows(); }
};

ScaledProblem scaled(const SkinProblem& problem) {
  const VectorXd root = problem.weights.cwiseSqrt();
  const VectorXd levels = root.cwiseProduct(problem.amplitudes);
  std::vector<Index> wanted;
  std::vector<Index> unwanted;
  ScaledProblem result;
  const double silence = levels.stableNorm();
  const double loudest = std::hypot((root.asDiagonal() * problem.target).stableNorm(), problem.outside.stableNorm());
  const double scale = silence > 0 ? silence : loudest;
  result.unit = scale * scale;
  if (!std::isfinite(result.unit) || !std::isfinite(loudest * loudest)) {
    throw std::invalid_argument("prove_bound: the cost overflows");
  }
  if (!(result.unit > 0)) {
    result.unit = 0.0;
    return result;
  }
  for (Index j = 0; j < levels.size(); ++j) {
    if (problem.target.row(j).isZero(0.0)) {
      result.constant += (levels(j) / scale) * (levels(j) / scale);
    } else {
      (levels(j) > 0 ? wanted : unwanted).push_back(j);
    }
  }
  const auto count = static_cast<Index>(wanted.size());
  result.wanted = levels(wanted) / scale;
  result.columns.resize(problem.channel_count(), count + static_cast<Index>(unwanted.size()) + problem.outside.rows());
  Index column = 0;
  for (const std::vector<Index>* faces : {&wanted, &unwanted}) {
    for (const Index j : *faces) {
      result.columns.col(column++) = (root(j) / scale) * problem.target.row(j).transpose();
    }
  }
  result.columns.rightCols(problem.outside.rows()) = problem.outside.transpose() / scale;
  result.energies = result.columns.colwise().squaredNorm();
  return result;
}

/// The relaxation without what changes its cost by no more than about a fifth of `missing`: rows of R at the end, which
/// count by their energy, and what of the other rows lies outside a basis of fewer dimensions, which counts by its
/// amplitude, twice the root of its energy times the cost.
LowRankRelaxation relaxation_of(const ScaledProblem& problem, double cost, double missing) {
  const VectorXd& energies = problem.energies;
  Index kept = energies.size();
  double left_out = 0.0;
  while (kept > problem.wanted.size() && left_out + energies(kept - 1) <= 0.1 * missing) {
    left_out += energies(--kept);
  }
  const double tolerance = 0.05 * missing / std::sqrt(cost * energies.head(kept).sum());
  return relaxed(problem.columns.leftCols(kept), problem.wanted, std::min(tolerance, kCoarsest));
}

/// A point of the dual problem: whatever g > 0 and d <= 0 are, they prove a bound.
struct DualPoint {
  VectorXd g;
  VectorXd d;
  double sum = 0.0;        // sum_j (b_j^2 - b_j g_j) + sum_n d_n
  double magnitude = 0.0;  // of the terms
  double cost = 0.0;       // of the relaxation, where the point was taken from it: sum and the positive part of d
};

/// s, m: 1 - b_j / g_j on the levels, 1 on the other columns.
VectorXd column_weights(const ScaledProblem& problem, const VectorXd& g) {
  VectorXd weights = VectorXd::Ones(problem.columns.cols());
  weights.head(g.size()) = level_weights(problem.wanted, g);
  return weights;
}

/// That of the rows Y^T with slack under all columns: g_j = |a_j Y|, d from the gradient. The positive part of d, 0 at
/// the least cost, would not count, and leaving it out only raises S.
DualPoint dual_at(const ScaledProblem& problem, const MatrixXcd& y) {
  const Index count = problem.wanted.size();
  MatrixXcd sent;
  multiply(y, problem.columns, sent);
  take_slack(sent);
  const VectorXd loudness = sent.leftCols(count).colwise().norm();
  DualPoint dual;
  dual.cost = (loudness - problem.wanted).squaredNorm() + sent.rightCols(sent.cols() - count).squaredNorm();
  dual.g = positive_loudness(loudness, problem.energies.head(count).cwiseSqrt(), problem.wanted);
  sent = sent * column_weights(problem, dual.g).asDiagonal();
  MatrixXcd gradient;
  multiply_by_adjoint(sent, problem.columns, gradient);
  dual.d = real_column_dots(y, gradient).cwiseMin(0.0);
  const auto levels = problem.wanted.array();
  dual.sum = (levels * (levels - dual.g.array())).sum() + dual.d.sum();
  dual.magnitude = (levels * (levels + dual.g.array())).sum() + dual.d.cwiseAbs().sum();
  return dual;
}

/// S + diag(d), complex conjugated as the columns give it; the lower triangle.
MatrixXcd weighed_columns(const ScaledProblem& problem, const VectorXd& g) {
  const Index n = problem.channel_count();
  const Index m = problem.columns.cols();
  const VectorXd weights = column_weights(problem, g);
  MatrixXcd matrix = MatrixXcd::Zero(n, n);
  MatrixXcd part(n, m);
  for (const double sign : {1.0, -1.0}) {
    Index count = 0;
    for (Index j = 0; j < m; ++j) {
      if (sign * weights(j) > 0) {
        part.col(count++) = std::sqrt(std::abs(weights(j))) * problem.columns.col(j);
      }
    }
    if (count > 0) {
      cblas_zherk(CblasColMajor, CblasLower, CblasNoTrans, static_cast<int>(n), static_cast<int>(count), sign,
                  part.data(), static_cast<int>(n), 1.0, matrix.data(), static_cast<int>(n));
    }
  }
  return matrix;
}

/// The bound that a dual point proves where S + shift is positive definite in double.
double bound_at(const ScaledProblem& problem, const DualPoint& dual, double shift) {
  const auto n = static_cast<double>(problem.channel_count());
  // Not |1 - b_j / g_j|: what cancels in it has rounded.
  VectorXd weights = VectorXd::Ones(problem.columns.cols());
  weights.head(dual.g.size()).array() += problem.wanted.array() / dual.g.array();
  const double magnitude = weights.dot(problem.energies) + dual.d.cwiseAbs().sum() + n * std::abs(shift);
  const double deficit = shift + rounding_of_eigenvalue(problem.channel_count(), problem.columns.cols(), magnitude);
  const double terms = n + 2.0 * static_cast<double>(dual.g.size());
  return dual.sum - n * deficit - rounding_of_sum(terms, dual.magnitude);
}

/// The least_shift that makes S + shift positive definite; the factor then holds it.
double factorised_shift(DualFactor& factor, const VectorXd& d, double shift) {
  return least_shift([&](double candidate) { return factor.factorise(d, candidate); }, shift);
}

/// What the Newton steps on the relaxation are held back by: a shift that makes S + shift positive definite and falls
/// by steps of two as far as it can, times what their gains ask for.
class StepDamping {
 public:
  explicit StepDamping(double shift) : shift_(shift) {}

  double shift() const { return shift_; }
  double sigma() const { return times_ * shift_; }

  /// No step has brought anything for a long time.
  bool is_exhausted() const { return times_ > 1e12; }

  /// Finds the shift anew and leaves the factor at sigma.
  ///
  /// least   below which the shift need not fall
  void settle(DualFactor& factor, const VectorXd& d, double least) {
    const bool try_less = --patience_ <= 0 && shift_ > least;
    const double less = std::max(least, 0.5 * shift_);
    if (try_less && factor.factorise(d, less)) {
      shift_ = less;
    } else {
      patience_ = try_less ? kPatience : patience_;
      shift_ = factorised_shift(factor, d, shift_);
    }
    if (times_ > 1.0 && !factor.factorise(d, sigma())) {
      throw std::domain_error("prove_bound: a larger shift made the dual matrix indefinite");
    }
  }

  /// gain   what a step brought over what it promised; NaN if it promised nothing
  void learn(double gain) {
    if (gain > 0.75) {
      times_ = std::max(1.0, times_ / 4.0);
    } else if (!(gain > 0.25)) {
      times_ *= 4.0;
    }
  }

 private:
  static constexpr int kPatience = 3;  // steps until a smaller shift is tried again

  double shift_;
  double times_ = 1.0;
  int patience_ = 0;
};

/// Channels whose column is not all 0: the others have no bearing on the cost, and no dual point curves along them.
std::vector<Index> heard_channels(const SkinProblem& problem) {
  std::vector<Index> heard;
  for (Index n = 0; n < problem.channel_count(); ++n) {
    if (!problem.target.col(n).isZero(0.0) || !problem.outside.col(n).isZero(0.0)) {
      heard.push_back(n);
    }
  }
  return heard;
}

/// The dual point that promises the highest bound.
struct Candidate {
  DualPoint dual;
  double shift = 0.0;
  double bound = -std::numeric_limits<double>::infinity();
};

/// Takes a dual point for the best one if it promises a bound distinctly nearer to its own sum than the best one's, and
/// comes as near as S allows, but for a tenth of `missing`.
void improve(const ScaledProblem& problem, const DualPoint& dual, double missing, DualFactor& factor, Candidate& best) {
  constexpr double kNearer = 0.7;
  const auto n = static_cast<double>(problem.channel_count());
  const bool is_first = !std::isfinite(best.bound);
  double shift = is_first ? kFirstShift / n : kNearer * (dual.sum - best.bound) / n;
  if (!(shift > 0)) {
    return;
  }
  factor.weigh(dual.g);
  if (is_first) {
    shift = factorised_shift(factor, dual.d, shift);
  }
  bool taken = false;
  bool definite = is_first || factor.factorise(dual.d, shift);
  while (definite) {
    const double bound = bound_at(problem, dual, shift);
    if (!(bound > best.bound)) {
      break;
    }
    best.shift = shift;
    best.bound = bound;
    taken = true;
    shift *= kNearer;
    definite = n * shift > 0.1 * missing && factor.factorise(dual.d, shift);
  }
  if (taken) {
    best.dual = dual;
  }
}

/// Replaces what a candidate promises by what the Cholesky factorisation of its S + shift proves.
void prove(const ScaledProblem& problem, Candidate& candidate) {
  require_finite_value(candidate.bound);
  const MatrixXcd weighed = weighed_columns(problem, candidate.dual.g);
  candidate.shift = least_shift([&](double shift) { return is_definite(weighed, shift - candidate.dual.d.array()); },
                                candidate.shift);
  candidate.bound = bound_at(problem, candidate.dual, candidate.shift);
}

}  // namespace

void require_valid(const OptimalityBoundOptions& options, const char* who) {
  if (options.width < 2 || options.width > 64 || options.max_iterations < 0 || !(options.tolerance > 0)) {
    throw std::invalid_argument(std::string(who) + ": an option is out of range");
  }
}

OptimalityBound prove_bound(const SkinProblem& problem, const OptimalityBoundOptions& options) {
  require_valid(problem, "prove_bound");
  require_valid(options, "prove_bound");
  const std::vector<Index> heard = heard_channels(problem);
  if (heard.empty()) {
    return {.bound = silent_cost(problem), .relaxed = silent_cost(problem), .converged = true};
  }
  if (static_cast<Index>(heard.size()) < problem.channel_count()) {
    SkinProblem fewer = problem;
    fewer.target = problem.target(Eigen::all, heard);
    fewer.outside = problem.outside(Eigen::all, heard);
    fewer.device.reset();  // it holds all channels
    return prove_bound(fewer, options);
  }
  const ScaledProblem whole = scaled(problem);
  OptimalityBound optimality_bound;
  if (whole.columns.cols() == 0) {
    optimality_bound.relaxed = whole.constant * whole.unit;
    optimality_bound.bound = optimality_bound.relaxed;
    optimality_bound.converged = true;
    return optimality_bound;
  }
  const PhaseSolution reached =
      solve_surface(problem, random_start(problem.channel_count(), options.seed), {.free_amplitudes = true});
  double scale = std::max(reached.cost_history.back() / whole.unit, kLeastBound);  // of what may be left out
  LowRankRelaxation relaxation = relaxation_of(whole, scale, options.tolerance * scale);
  RelaxedPoint point = relaxed_point(relaxation, relaxed_start(drive(reached), options.width, options.seed));
  const auto n = static_cast<double>(whole.channel_count());
  DualFactor factor(relaxation);
  StepDamping damping(kFirstShift / n);
  Candidate best;
  double cost = 0.0;     // of the relaxation
  double missing = 0.0;  // between it and the bound at most
  while (true) {
    const DualPoint dual = dual_at(whole, point.y);
    cost = dual.cost;
    missing = options.tolerance * std::max(cost + whole.constant, kLeastBound);
    improve(whole, dual, missing, factor, best);
    factor.weigh(positive_loudness(relaxation, point));
    damping.settle(factor, point.d, 0.25 * missing / n);
    if (cost - best.bound <= missing || optimality_bound.iterations >= options.max_iterations ||
        damping.is_exhausted()) {
      break;
    }
    ++optimality_bound.iterations;
    double gain = 0.0;
    RelaxedPoint next = newton_step(relaxation, point, factor, damping.sigma(), gain);
    if (next.cost < point.cost) {
      point = std::move(next);
    }
    damping.learn(gain);
    if (const double least = std::max(point.cost + whole.constant, kLeastBound); least < 0.25 * scale) {
      scale = least;
      relaxation = relaxation_of(whole, scale, options.tolerance * scale);
      point = relaxed_point(relaxation, std::move(point.y));
    }
  }
  prove(whole, best);
  optimality_bound.converged = cost - best.bound <= missing;
  optimality_bound.relaxed = (cost + whole.constant) * whole.unit;
  optimality_bound.bound = std::max(0.0, best.bound + whole.constant) * whole.unit;
  return optimality_bound;
}

double optimality_gap(const OptimalityBound& optimality_bound, double reached, double silence) {
  return optimality_bound.bound > 1e-9 * silence ? (reached - optimality_bound.bound) / optimality_bound.bound
                                                 : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace touchfield
