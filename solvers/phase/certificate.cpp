#include "solvers/phase/certificate.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "solvers/phase/dual_factor.h"
#include "solvers/phase/low_rank_relaxation.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kLeastBound = 1e-4;  // of the cost of silence: the tolerance is a share of no less
constexpr double kNewtonStep = 4.0;   // from one shift of the Newton step that is tried to the next
constexpr double kBoundStep = 2.0;    // of the bound

/// The problem in units in which the cost of silence is 1, with its constant part apart.
struct ScaledProblem {
  LowRankRelaxation relaxation;
  double unit = 0.0;      // of the cost; 0 where nothing can sound
  double constant = 0.0;  // of levels that nothing reaches
};

ScaledProblem scaled(const SkinProblem& problem) {
  const VectorXd root = problem.weights.cwiseSqrt();
  const VectorXd levels = root.cwiseProduct(problem.amplitudes);
  std::vector<Index> wanted;
  std::vector<Index> unwanted;
  ScaledProblem result;
  const double silence = levels.stableNorm();
  const double loudest = std::hypot((root.asDiagonal() * problem.target).stableNorm(), problem.quiet.stableNorm());
  const double scale = silence > 0 ? silence : loudest;
  result.unit = scale * scale;
  if (!std::isfinite(result.unit) || !std::isfinite(loudest * loudest)) {
    throw std::invalid_argument("certify: the cost overflows");
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
  result.relaxation.levels.resize(count);
  result.relaxation.columns.resize(problem.channel_count(),
                                   count + static_cast<Index>(unwanted.size()) + problem.quiet.rows());
  Index column = 0;
  for (const std::vector<Index>* faces : {&wanted, &unwanted}) {
    for (const Index j : *faces) {
      if (column < count) {
        result.relaxation.levels(column) = levels(j) / scale;
      }
      result.relaxation.columns.col(column++) = (root(j) / scale) * problem.target.row(j).transpose();
    }
  }
  result.relaxation.columns.rightCols(problem.quiet.rows()) = problem.quiet.transpose() / scale;
  return result;
}

/// A point of the dual problem: whatever g > 0 and d <= 0 are, they prove a bound.
struct DualPoint {
  VectorXd g;
  VectorXd d;
  double sum = 0.0;        // sum_j (b_j^2 - b_j g_j) + sum_n d_n
  double magnitude = 0.0;  // of the terms
};

/// The positive part of d would not count, and leaving it out only raises S.
DualPoint dual_of(const LowRankRelaxation& relaxation, const RelaxedPoint& point) {
  DualPoint dual;
  dual.g = positive_loudness(relaxation, point);
  dual.d = point.d.cwiseMin(0.0);
  const auto levels = relaxation.levels.array();
  dual.sum = (levels * (levels - dual.g.array())).sum() + dual.d.sum();
  dual.magnitude = (levels * (levels + dual.g.array())).sum() + dual.d.cwiseAbs().sum();
  return dual;
}

/// The most by which the smallest eigenvalue of S + shift can lie below 0 although its Cholesky factorisation went
/// through, rounding in S included.
///
/// A completed factorisation is the exact one of a matrix that differs by at most gamma |L||L^H| entry by entry, of
/// norm
/// <= gamma trace / (1 - gamma), with gamma <= 8 (n + 4) u in complex arithmetic whatever the order of the sums; the
/// same holds for the sum of m products that makes each entry of S.
double rounding_of_eigenvalue(const LowRankRelaxation& relaxation, const DualPoint& dual, double shift) {
  const auto n = static_cast<double>(relaxation.channel_count());
  const auto m = static_cast<double>(relaxation.columns.cols());
  const double energy = (dual_weights(relaxation, dual.g).array().abs() *
                         relaxation.columns.cwiseAbs2().colwise().sum().transpose().array())
                            .sum();
  return 4.0 * kEps * (n + m + 16.0) * (energy + dual.d.cwiseAbs().sum() + n * std::abs(shift));
}

/// The bound that a dual point proves where no eigenvalue of S lies more than `deficit` > 0 below 0.
double bound_with(const LowRankRelaxation& relaxation, const DualPoint& dual, double deficit) {
  const auto n = static_cast<double>(relaxation.channel_count());
  const double terms = n + 2.0 * static_cast<double>(dual.g.size());
  return dual.sum - n * deficit - 2.0 * kEps * (terms + 16.0) * dual.magnitude;
}

/// How far the Newton steps on the relaxation are held back, against the shift that S needs.
class StepDamping {
 public:
  double value() const { return value_; }

  /// gain   what a step brought over what it promised; NaN if it promised nothing
  void learn(double gain) {
    if (gain > 0.75) {
      value_ = std::max(1.0, value_ / 4.0);
    } else if (!(gain > 0.25)) {
      value_ *= 4.0;
    }
  }

 private:
  double value_ = 1.0;
};

void require_valid(const CertificateOptions& options) {
  if (options.width < 2 || options.width > 64 || options.max_iterations < 0 || !(options.tolerance > 0)) {
    throw std::invalid_argument("certify: an option is out of range");
  }
}

/// The dual point that promises the highest bound.
struct Candidate {
  DualPoint dual;
  double shift = 0.0;
  double bound = -std::numeric_limits<double>::infinity();
};

/// The first of shift, step shift, step^2 shift, ... that makes S + shift positive definite; `factor` then holds it.
double least_shift(DualFactor& factor, const VectorXd& d, double shift, double step) {
  while (!factor.factorise(d, shift)) {
    shift *= step;
    if (!std::isfinite(shift)) {
      throw std::domain_error("certify: the relaxation holds a value that is not finite");
    }
  }
  return shift;
}

double bound_at(const LowRankRelaxation& relaxation, const DualPoint& dual, double shift) {
  return bound_with(relaxation, dual, shift + rounding_of_eigenvalue(relaxation, dual, shift));
}

/// Replaces what a candidate promises by what the Cholesky factorisation of its S + shift proves. True if that is all
/// that was promised.
bool prove(const LowRankRelaxation& relaxation, Candidate& candidate) {
  DualFactor factor(relaxation, DualFactor::Form::dense);
  factor.weigh(candidate.dual.g);
  const double promised =
      std::exchange(candidate.shift, least_shift(factor, candidate.dual.d, candidate.shift, kBoundStep));
  candidate.bound = bound_at(relaxation, candidate.dual, candidate.shift);
  return candidate.shift == promised;
}

}  // namespace

Certificate certify(const SkinProblem& problem, const CertificateOptions& options) {
  require_valid(problem, "certify");
  require_valid(options);
  const ScaledProblem whole = scaled(problem);
  const LowRankRelaxation& relaxation = whole.relaxation;
  Certificate certificate;
  if (relaxation.columns.cols() == 0) {
    certificate.relaxed = whole.constant * whole.unit;
    certificate.bound = certificate.relaxed;
    certificate.converged = true;
    return certificate;
  }
  RelaxedPoint point = relaxed_start(relaxation, options.width, options.seed);
  DualFactor factor(relaxation);
  StepDamping damping;
  const auto n = static_cast<double>(relaxation.channel_count());
  double shift = 0.1 / n;  // of the Newton step
  double bound_shift = shift;
  Candidate best;
  while (true) {
    const DualPoint dual = dual_of(relaxation, point);
    factor.weigh(dual.g);
    const double missing = options.tolerance * std::max(point.cost + whole.constant, kLeastBound);
    const double least = 0.25 * missing / n;
    bound_shift = least_shift(factor, dual.d, std::max(bound_shift / (2.0 * kBoundStep), least), kBoundStep);
    const double bound = bound_at(relaxation, dual, bound_shift);
    if (bound > best.bound) {
      best = {dual, bound_shift, bound};
    }
    certificate.converged = point.cost - best.bound <= missing;
    if (!certificate.converged) {
      // Where d > 0 somewhere the bound stays below the relaxation, which may be at its least all the same.
      shift = least_shift(factor, point.d, std::max(shift / kNewtonStep, least), kNewtonStep);
      certificate.converged = n * shift <= missing;
    }
    if (certificate.converged || certificate.iterations >= options.max_iterations) {
      break;
    }
    ++certificate.iterations;
    const double sigma = damping.value() * shift;
    if (sigma > shift && !factor.factorise(point.d, sigma)) {
      throw std::domain_error("certify: a larger shift made the dual matrix indefinite");
    }
    double gain = 0.0;
    RelaxedPoint next = newton_step(relaxation, point, factor, sigma, gain);
    if (next.cost < point.cost) {
      point = std::move(next);
    }
    damping.learn(gain);
  }
  certificate.converged = prove(relaxation, best) && certificate.converged;
  certificate.bound = std::max(0.0, best.bound + whole.constant) * whole.unit;
  certificate.relaxed = (point.cost + whole.constant) * whole.unit;
  return certificate;
}

double optimality_gap(const SkinProblem& problem, const Certificate& certificate, double reached) {
  return certificate.bound > 1e-9 * silent_cost(problem) ? (reached - certificate.bound) / certificate.bound
                                                         : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace touchfield
