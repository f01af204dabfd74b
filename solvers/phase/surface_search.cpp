#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/factorisations.h"
#include "solvers/linear/random_share.h"
#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

constexpr double kDriveTolerance = 0.01;    // on ln(epsilon): the start need not be better
constexpr double kLeastDrivePrice = 1e-10;  // epsilon over the largest eigenvalue of A A^H: above its rounding error
constexpr double kFittedPrice = 1e-6;       // the same of fitted_start
constexpr int kFittedRounds = 30;

/// The rows that matter to a drive, A = [diag(sqrt w) H_T over the faces that want sound; R], and what they want.
struct Rows {
  Eigen::MatrixXcd matrix;
  Eigen::VectorXd wanted;  // b = sqrt(w) p'
};

Rows wanting_rows(const SkinProblem& problem) {
  std::vector<Eigen::Index> faces;
  for (Eigen::Index j = 0; j < problem.target_count(); ++j) {
    if (problem.amplitudes(j) > 0) {
      faces.push_back(j);
    }
  }
  const auto count = static_cast<Eigen::Index>(faces.size());
  Rows rows{Eigen::MatrixXcd(count + problem.outside.rows(), problem.channel_count()), Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index j = faces[static_cast<std::size_t>(i)];
    const double root_weight = std::sqrt(problem.weights(j));
    rows.matrix.row(i) = root_weight * problem.target.row(j);
    rows.wanted(i) = root_weight * problem.amplitudes(j);
  }
  rows.matrix.bottomRows(problem.outside.rows()) = problem.outside;
  return rows;
}

/// The relaxed problem's answer where a unit of drive energy costs epsilon.
class PricedDrive {
 public:
  explicit PricedDrive(const Rows& rows)
      : rows_(rows), eigen_(hermitian_eigen(hermitian_product(rows.matrix.adjoint()))) {
    weighted_ = rows.wanted.asDiagonal() * eigen_.vectors.topRows(rows.wanted.size());
  }

  double largest_eigenvalue() const { return eigen_.values.tail(1)(0); }

  /// Eliminating q leaves  y^H diag(b) epsilon (A A^H + epsilon)^-1 diag(b) y; y is the eigenvector of its smallest
  /// eigenvalue, |y|^2 = K. Returns |q|^2.
  double solve(double epsilon) {
    const Eigen::VectorXd priced = (eigen_.values.array().max(0.0) + epsilon).inverse();
    const Eigen::MatrixXcd scaled = weighted_ * (epsilon * priced).cwiseSqrt().asDiagonal();
    const Eigen::VectorXcd y = hermitian_eigen(hermitian_product(scaled.adjoint())).vectors.col(0) *
                               std::sqrt(static_cast<double>(weighted_.rows()));
    coefficients_ = priced.asDiagonal() * (weighted_.adjoint() * y);
    return energy();
  }

  /// The same for phases y that are those of the pressures that they lead to, from y = 1. Returns |q|^2.
  double fit(double epsilon) {
    const Eigen::VectorXd values = eigen_.values.array().max(0.0);
    Eigen::VectorXcd y = Eigen::VectorXcd::Ones(weighted_.rows());
    for (int round = 0; round < kFittedRounds; ++round) {
      coefficients_ = (values.array() + epsilon).inverse().matrix().asDiagonal() * (weighted_.adjoint() * y);
      y = phasors_of(weighted_ * values.cwiseProduct(coefficients_));
    }
    return energy();
  }

  Eigen::VectorXcd drives() const { return rows_.matrix.adjoint() * (eigen_.vectors * coefficients_); }

 private:
  double energy() const { return (eigen_.values.array().max(0.0) * coefficients_.array().abs2()).sum(); }

  const Rows& rows_;
  HermitianEigen eigen_;           // of A A^H
  Eigen::MatrixXcd weighted_;      // diag(b) V_T
  Eigen::VectorXcd coefficients_;  // of (A A^H + epsilon)^-1 [b y; 0] in the eigenvectors
};

constexpr int kTrial = 3;             // steps from each start
constexpr int kStepsAtFullDrive = 5;  // before these, for starts that have to catch up
constexpr double kDamping = 1e-3;     // of the first step: all starts are near some minimum
constexpr double kStandstill = 2e-4;  // of the cost, in six steps

constexpr int kMostTurns = 30;
constexpr double kSettledShare = 1e-4;  // of the cost, in a turn

/// sum_n u_n: what the deviations of all channels at amplitude 1 add, per variance.
double deviation_of_all(const SkinProblem& problem) {
  return problem.weights.dot(problem.target.rowwise().squaredNorm()) + problem.outside.squaredNorm();
}

/// The same problem for fields that are `factor` times as strong.
SkinProblem scaled(const SkinProblem& problem, double factor) {
  return {.target = factor * problem.target,
          .amplitudes = problem.amplitudes,
          .weights = problem.weights,
          .outside = factor * problem.outside};
}

}  // namespace

Eigen::VectorXcd adjoint_start(const SkinProblem& problem) {
  require_valid(problem, "adjoint_start");
  const SkinField wanted{(problem.weights.array() * problem.amplitudes.array()).cast<std::complex<double>>(),
                         Eigen::VectorXcd::Zero(problem.outside.rows())};
  Eigen::VectorXcd drives;
  send_back(problem, wanted, drives);
  return phasors_of(drives);
}

Eigen::VectorXcd spectral_start(const SkinProblem& problem) {
  require_valid(problem, "spectral_start");
  const Rows rows = wanting_rows(problem);
  const auto channels = static_cast<double>(problem.channel_count());
  if (rows.wanted.size() == 0 || rows.matrix.isZero(0.0)) {
    return Eigen::VectorXcd::Ones(problem.channel_count());
  }
  PricedDrive priced(rows);
  double low = std::log(kLeastDrivePrice * priced.largest_eigenvalue());
  if (priced.solve(std::exp(low)) > channels) {
    // |q| <= |b y| / (2 sqrt(epsilon)): beyond this price it is below sqrt(N) for sure.
    const double energy = rows.wanted.cwiseAbs2().maxCoeff() * static_cast<double>(rows.wanted.size());
    double high = std::max(low, std::log(energy / channels));
    while (high - low > kDriveTolerance) {
      const double middle = 0.5 * (low + high);
      (priced.solve(std::exp(middle)) > channels ? low : high) = middle;
    }
    priced.solve(std::exp(high));
  }
  return phasors_of(priced.drives());
}

Eigen::VectorXcd fitted_start(const SkinProblem& problem) {
  require_valid(problem, "fitted_start");
  const Rows rows = wanting_rows(problem);
  if (rows.wanted.size() == 0 || rows.matrix.isZero(0.0)) {
    return Eigen::VectorXcd::Zero(problem.channel_count());
  }
  PricedDrive priced(rows);
  double price = kFittedPrice;
  while (priced.fit(price * priced.largest_eigenvalue()) > static_cast<double>(problem.channel_count()) && price < 1) {
    price *= 10;
  }
  const Eigen::VectorXcd drives = priced.drives();
  return drives.array() / drives.array().abs().max(1.0);
}

Eigen::VectorXcd random_start(Eigen::Index channels, unsigned seed) {
  if (channels < 0) {
    throw std::invalid_argument("random_start: the number of channels is negative");
  }
  std::mt19937_64 generator(seed);
  Eigen::VectorXcd drives(channels);
  for (std::complex<double>& drive : drives) {
    drive = std::polar(1.0, 2.0 * std::numbers::pi * random_share(generator));
  }
  return drives;
}

PhaseSolution search_surface(const SkinProblem& problem, const Eigen::MatrixXcd& others, SurfaceOptions options,
                             const IterationCallback& callback) {
  const Eigen::Index channels = problem.channel_count();
  const AnnealedStarts annealed = annealed_starts(problem, options.free_level);
  SurfaceOptions first = options;
  first.iterations = kStepsAtFullDrive;
  const auto after_some_steps = [&](const Eigen::VectorXcd& start) {
    return drive(solve_surface(problem, start, first));
  };
  const Eigen::VectorXcd from_zero = after_some_steps(Eigen::VectorXcd::Ones(channels));
  const Eigen::MatrixXcd at_full =
      annealed.level < 1.0 ? Eigen::MatrixXcd(after_some_steps(annealed.at_full)) : Eigen::MatrixXcd(channels, 0);
  Eigen::MatrixXcd starts(channels, annealed.drives.cols() + at_full.cols() + 1 + others.cols());
  starts << annealed.drives, at_full, from_zero, others;
  options.trial = kTrial;
  options.initial_damping = kDamping;
  options.standstill = kStandstill;
  if (!options.free_amplitudes) {
    return solve_surface(problem, starts, options, callback);
  }
  // Some steps do not tell which of the two ways ends lower, so both are gone to their ends, each half of the work.
  const auto half = [&](int done) -> IterationCallback {
    return [&callback, done](int iteration, double cost) { callback((done + iteration + 1) / 2, cost); };
  };
  PhaseSolution first_way = solve_surface(problem, starts, options, callback ? half(0) : callback);
  PhaseSolution fitted =
      solve_surface(problem, fitted_start(problem), options, callback ? half(options.iterations) : callback);
  return fitted.cost_history.back() < first_way.cost_history.back() ? fitted : first_way;
}

ChannelMoments channel_moments(const ChannelTolerances& tolerances) {
  if (!(tolerances.phase >= 0 && tolerances.gain >= 0 && tolerances.dead >= 0 && tolerances.dead < 1) ||
      !std::isfinite(tolerances.phase) || !std::isfinite(tolerances.gain)) {
    throw std::invalid_argument("channel tolerances: phase and gain must be >= 0, dead must be 0 to below 1");
  }
  const double alive = 1.0 - tolerances.dead;
  const double mean = alive * std::exp(-0.5 * tolerances.phase * tolerances.phase);
  return {mean, alive * (1.0 + tolerances.gain * tolerances.gain) - mean * mean};
}

double expected_cost(const SkinProblem& problem, const Eigen::VectorXcd& q, const ChannelTolerances& tolerances) {
  const ChannelMoments moments = channel_moments(tolerances);
  const Eigen::VectorXd energy = q.cwiseAbs2();
  const double target = problem.weights.dot(problem.target.cwiseAbs2() * energy);
  const double outside = problem.outside.rows() > 0 ? (problem.outside.cwiseAbs2() * energy).sum() : 0.0;
  return skin_cost(problem, moments.mean * q) + moments.variance * (target + outside);
}

PhaseSolution solve_robust_surface(const SkinProblem& problem, const Eigen::MatrixXcd& starts,
                                   const RobustOptions& options, const IterationCallback& callback) {
  const ChannelMoments moments = channel_moments(options.tolerances);
  const double added = moments.variance * deviation_of_all(problem);
  const SurfaceOptions each{.iterations = options.iterations};
  PhaseSolution best;
  best.status = PhaseStatus::kIterationLimit;
  Eigen::MatrixXcd from = starts;
  double level = 1.0;
  double cost = HUGE_VAL;
  for (int turn = 1; turn <= kMostTurns && best.status != PhaseStatus::kConverged; ++turn) {
    const SkinProblem at_level = scaled(problem, moments.mean * level);
    const bool search = turn == 1 && options.search;
    const PhaseSolution found =
        search ? search_surface(at_level, from, each, {}) : solve_surface(at_level, from, each, {});
    const Eigen::VectorXcd phasors = drive(found);
    level = std::min(1.0, best_level(problem, moments.mean * phasors, added));
    const double now = skin_cost(problem, moments.mean * level * phasors) + level * level * added;
    best.status = cost - now < kSettledShare * now ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
    best.iterations += found.iterations;
    if (now < cost) {
      best.phases = found.phases;
      best.amplitudes = Eigen::VectorXd::Constant(phasors.size(), level);
      from = phasors;
      cost = now;
    }
    best.cost_history.push_back(cost);
    if (callback) {
      callback(turn, cost);
    }
  }
  return best;
}

}  // namespace touchfield
