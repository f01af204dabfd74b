#include "solvers/phase/surface.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "solvers/phase/levenberg_marquardt.h"
#include "solvers/phase/skin_jacobian.h"

namespace touchfield {

namespace {

using Complex = std::complex<double>;
// Share of the curvature of |q_n| = 1 that joins the linear model. The other part of what Gauss-Newton leaves out, from
// |u_j|, has the other sign and fewer rows: with all of the curvature the model is too stiff.
constexpr double kCurvature = 0.3;
constexpr double kLargestBend = 0.3;  // of a step: what second order adds, twice, over what first order moves
constexpr double kFull = 1.0 - 1e-6;  // amplitudes from here on count as full drive
constexpr double kRounding = 1e-14;   // of the cost, a sum of thousands of squares
constexpr double kSettled = 0.003;    // an accepted step that lowers the cost by less lets the amplitudes go

void require_options(const SkinProblem& problem, const Eigen::MatrixXcd& starts, const SurfaceOptions& options) {
  if (starts.rows() != problem.channel_count() || starts.cols() == 0) {
    throw std::invalid_argument("solve_surface: the start has another size than the problem has channels");
  }
  if (!starts.allFinite()) {
    throw std::invalid_argument("solve_surface: the start holds a value that is not finite");
  }
  if (options.iterations < 1 || options.trial < 1 || !(options.initial_damping > 0) ||
      !std::isfinite(options.initial_damping) || !(options.gradient_tolerance >= 0) || !(options.step_tolerance >= 0) ||
      !(options.cost_tolerance >= 0) || !(options.standstill >= 0)) {
    throw std::invalid_argument("solve_surface: an option is out of range");
  }
}

/// Drives q_n = amplitudes_n phasors_n with their field.
struct Point {
  Eigen::VectorXd phases;
  Eigen::VectorXd amplitudes;
  Eigen::VectorXcd phasors;
  Eigen::VectorXcd drives;
  SkinField field;
  double cost = 0.0;

  void evaluate(const SkinProblem& problem) {
    phasors.resize(phases.size());
    drives.resize(phases.size());
    for (Eigen::Index n = 0; n < phases.size(); ++n) {
      phasors(n) = std::polar(1.0, phases(n));
      drives(n) = amplitudes(n) * phasors(n);
    }
    send(problem, drives, field);
    cost = field_cost(problem, field);
  }
};

Point starting_point(const SkinProblem& problem, const Eigen::VectorXcd& start, const SurfaceOptions& options) {
  Point point;
  point.phases = start.unaryExpr([](Complex q) { return q == Complex(0.0) ? 0.0 : std::arg(q); }).real();
  const double loudest = start.cwiseAbs().maxCoeff();
  const bool reduced = options.free_level && loudest > 0 && loudest < 1;
  point.amplitudes = Eigen::VectorXd::Constant(start.size(), reduced ? loudest : 1.0);
  if (options.free_amplitudes) {
    point.amplitudes = start.cwiseAbs().cwiseMin(1.0);
  }
  point.evaluate(problem);
  return point;
}

/// Where Levenberg-Marquardt is, with the linear model there, in moves of the drives in their own frames (see
/// SkinJacobian). The model is |f + J h|^2 + h^T diag(curvature) h:
///
///   a channel that only turns      moves along the tangent and back onto its circle of radius a, phi += atan(t / a),
///   or
///                                  further by the bend of the valley; the circle's own curvature is the outward pull
///                                  of the cost, max(0, -Re(conj(phasor_n) g_n)) / a
///   a free one                     moves in the plane; an outward pull is damped by pull / (1 - a), so that alone it
///                                  reaches the bound and does not pass it
class Surface {
 public:
  Surface(const SkinProblem& problem, const Eigen::VectorXcd& start, const SurfaceOptions& options)
      : problem_(problem),
        options_(options),
        point_(starting_point(problem, start, options)),
        candidate_(point_),
        jacobian_(problem),
        only_phases_(!options.free_amplitudes || (point_.amplitudes.array() == 1.0).all()) {
    linearise();
  }

  double cost() const { return point_.cost; }
  double largest_row() const { return jacobian_.largest_row(); }
  const Point& point() const { return point_; }

  bool is_flat() const { return gradient_.cwiseAbs().maxCoeff() <= options_.gradient_tolerance * point_.cost; }

  /// Finds the step at damping mu and the point that it leads to. False if there is none.
  bool solve(double mu) {
    damping_ = curvature_.array() + mu;
    // What is left out of J^T J is less than the damping in every direction, far less in nearly all of them: that
    // changes the steps, not what they lead to.
    jacobian_.leave_out_up_to(mu);
    if (!solver_.solve(jacobian_, damping_, step_)) {
      return false;
    }
    accelerate();
    const bool clipped = move();
    candidate_.evaluate(problem_);
    if (clipped) {
      jacobian_.apply(step_, moved_residual_);
      predicted_ =
          -2.0 * step_.dot(gradient_) - moved_residual_.squaredNorm() - step_.dot(curvature_.cwiseProduct(step_));
    } else {
      predicted_ = step_.dot(mu * step_ - gradient_);
    }
    tiny_ = step_.norm() <= options_.step_tolerance * (1.0 + point_.phases.norm());
    return true;
  }

  bool lowers_cost() const { return candidate_.cost < point_.cost && predicted_ > 0; }

  /// Channels that the step would have pushed out are held. At rest, unless some of those could still move inwards.
  Refusal refuse() {
    if (tiny_ || std::abs(predicted_) <= kRounding * point_.cost) {
      return release_clipped() ? Refusal::kDamp : Refusal::kAtRest;
    }
    return hold_clipped() ? Refusal::kSameAgain : Refusal::kDamp;
  }

  /// Lets the amplitudes move from here on. Returns whether they were held and may.
  bool free_amplitudes() {
    const bool held = only_phases_ && options_.free_amplitudes;
    if (held) {
      only_phases_ = false;
      linearise();
    }
    return held;
  }

  /// Goes to the candidate. Returns the gain ratio.
  double accept() {
    before_ = point_.cost;
    const double gain = (point_.cost - candidate_.cost) / predicted_;
    std::swap(point_, candidate_);
    if (level_moves()) {
      settle_level();
    }
    linearise();
    return gain;
  }

  /// Where the phases have settled the amplitudes are let go.
  bool rests() {
    const double fall = before_ - point_.cost;
    if (tiny_ || is_flat() || fall < options_.cost_tolerance * before_) {
      return true;
    }
    if (fall < kSettled * before_) {
      free_amplitudes();
    }
    return false;
  }

  /// Brings all drives to the level at which the cost is least, at most to full drive.
  void settle_level() {
    const double level = point_.amplitudes(0) * best_level(problem_, point_.drives);
    point_.amplitudes.setConstant(std::min(1.0, level));
    point_.evaluate(problem_);
  }

 private:
  /// Lets the channels at full drive that the step would have pushed beyond it only turn, until a step is accepted.
  /// Returns whether there were any.
  bool hold_clipped() {
    const auto removed = std::erase_if(
        radial_, [&](Eigen::Index n) { return point_.amplitudes(n) >= kFull && candidate_.amplitudes(n) >= 1.0; });
    if (removed > 0) {
      held_ = true;
      set_moves();
    }
    return removed > 0;
  }

  /// Lets those that hold_clipped holds move again. Returns whether there were any.
  bool release_clipped() {
    const bool held = held_;
    if (held) {
      linearise();
    }
    return held;
  }

  /// At full drive a level that fell on the way would not come back where the phases need all of it in the end.
  bool level_moves() const { return options_.free_level && only_phases_ && point_.amplitudes(0) < 1.0; }

  bool is_pinned(Eigen::Index n) const { return where_radial_[static_cast<std::size_t>(n)] < 0; }

  /// A channel at full drive that the cost would push beyond it only turns; any other free one moves in the disc.
  void linearise() {
    held_ = false;
    radial_.clear();
    jacobian_.set(point_.field, point_.phasors);
    if (!only_phases_) {
      for (Eigen::Index n = 0; n < problem_.channel_count(); ++n) {
        if (point_.amplitudes(n) < kFull || outward(n) < 0.0) {
          radial_.push_back(n);
        }
      }
    }
    set_moves();
  }

  /// Takes the channels of radial_ for those that move in the disc.
  void set_moves() {
    const Eigen::Index channels = problem_.channel_count();
    where_radial_.assign(static_cast<std::size_t>(channels), -1);
    for (std::size_t i = 0; i < radial_.size(); ++i) {
      where_radial_[static_cast<std::size_t>(radial_[i])] = channels + static_cast<Eigen::Index>(i);
    }
    jacobian_.set_radial(radial_);
    jacobian_.gradient(gradient_);
    curvature_ = Eigen::VectorXd::Zero(jacobian_.columns());
    for (Eigen::Index n = 0; n < channels; ++n) {
      const double push = std::max(0.0, outward(n));
      if (is_pinned(n)) {
        curvature_(n) = kCurvature * push / point_.amplitudes(n);
      } else {
        curvature_(where_radial_[static_cast<std::size_t>(n)]) = push / (1.0 - std::min(point_.amplitudes(n), kFull));
      }
    }
  }

  /// How fast half the cost falls with the amplitude of a channel.
  double outward(Eigen::Index n) const {
    return -(std::conj(point_.phasors(n)) * jacobian_.drive_gradient()(n)).real();
  }

  /// The second-order part of the step where phases alone move, which bends it along the valley.
  void accelerate() {
    bent_ = false;
    if (!radial_.empty()) {
      return;
    }
    turns_ = step_.cwiseQuotient(point_.amplitudes);
    jacobian_.second_derivative(point_.amplitudes, turns_, second_derivative_);
    if (!solver_.solve_again(jacobian_, second_derivative_, bend_)) {
      return;
    }
    bent_ = true;
    const double longest = kLargestBend * step_.norm();
    const double length = bend_.norm();
    bend_ *= 0.5 * (length > longest ? longest / length : 1.0);
  }

  /// The candidate's phases and amplitudes. Returns whether an amplitude met its bound, the step is cut with it.
  bool move() {
    bool clipped = false;
    for (Eigen::Index n = 0; n < point_.phases.size(); ++n) {
      if (is_pinned(n)) {
        const double a = point_.amplitudes(n);
        candidate_.phases(n) = point_.phases(n) + (bent_ ? (step_(n) + bend_(n)) / a : std::atan(step_(n) / a));
        candidate_.amplitudes(n) = only_phases_ ? a : 1.0;
        continue;
      }
      const Eigen::Index radial = where_radial_[static_cast<std::size_t>(n)];
      Complex drive(point_.amplitudes(n) + step_(radial), step_(n));  // in the channel's frame
      double amplitude = std::abs(drive);
      if (amplitude > 1.0) {
        drive /= amplitude;
        amplitude = 1.0;
        step_(radial) = drive.real() - point_.amplitudes(n);
        step_(n) = drive.imag();
        clipped = true;
      }
      candidate_.phases(n) = point_.phases(n) + (amplitude > 0.0 ? std::arg(drive) : 0.0);
      candidate_.amplitudes(n) = amplitude;
    }
    return clipped;
  }

  const SkinProblem& problem_;
  const SurfaceOptions& options_;
  Point point_;
  Point candidate_;
  SkinJacobian jacobian_;
  DampedStep solver_;
  bool only_phases_;   // amplitudes are not free, or held until the phases have settled
  bool held_ = false;  // some channels only turn because a step would have pushed them out
  std::vector<Eigen::Index> radial_;
  std::vector<Eigen::Index> where_radial_;  // column of a channel's radial move, -1 if it only turns
  Eigen::VectorXd gradient_;
  Eigen::VectorXd curvature_;
  Eigen::VectorXd damping_;
  Eigen::VectorXd step_;
  Eigen::VectorXd turns_;
  Eigen::VectorXd second_derivative_;
  Eigen::VectorXd bend_;
  bool bent_ = false;
  Eigen::VectorXd moved_residual_;
  double predicted_ = 0.0;
  double before_ = 0.0;  // the cost, before the step accepted last
  bool tiny_ = false;    // the step
};

/// The way from one start.
class Path {
 public:
  Path(const SkinProblem& problem, const Eigen::VectorXcd& start, const SurfaceOptions& options)
      : options_(options), surface_(problem, start, options), damping_(first_damping()) {
    const bool done = surface_.is_flat() && !(surface_.free_amplitudes() && !surface_.is_flat());
    solution_.status = done ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
    solution_.cost_history.reserve(static_cast<std::size_t>(std::min(options.iterations, 1000)) + 1);
    solution_.cost_history.push_back(surface_.cost());
  }

  double cost() const { return surface_.cost(); }

  /// Until so many steps are done from the start on, or it ends by itself.
  void go_on(int steps, const IterationCallback& callback) {
    iterate(solution_, steps, callback, [&](PhaseStatus& status) {
      status = try_step(surface_, damping_);
      if (status == PhaseStatus::kIterationLimit && stands_still()) {
        status = PhaseStatus::kConverged;
      }
      if (status != PhaseStatus::kIterationLimit && surface_.free_amplitudes() && !surface_.is_flat()) {
        status = PhaseStatus::kIterationLimit;  // only the phases had come to rest
        damping_ = MadsenDamping(first_damping());
        freed_ = solution_.cost_history.size();
      }
      return surface_.cost();
    });
  }

  PhaseSolution solution() {
    if (options_.free_level && !options_.free_amplitudes) {
      surface_.settle_level();
      solution_.cost_history.back() = surface_.cost();
    }
    PhaseSolution solution = solution_;
    solution.phases = wrapped(surface_.point().phases);
    solution.amplitudes = surface_.point().amplitudes;
    return solution;
  }

 private:
  /// With the step that is not in the history yet.
  bool stands_still() const {
    constexpr std::size_t kSteps = 6;
    const std::vector<double>& costs = solution_.cost_history;
    return costs.size() >= freed_ + kSteps &&
           costs[costs.size() - kSteps] - surface_.cost() < options_.standstill * surface_.cost();
  }

  double first_damping() const { return options_.initial_damping * surface_.largest_row(); }

  const SurfaceOptions& options_;
  Surface surface_;
  MadsenDamping damping_;
  PhaseSolution solution_;
  std::size_t freed_ = 0;  // steps before the amplitudes were let go
};

}  // namespace

PhaseSolution solve_surface(const SkinProblem& problem, const Eigen::MatrixXcd& starts, const SurfaceOptions& options,
                            const IterationCallback& callback) {
  require_valid(problem, "solve_surface");
  require_options(problem, starts, options);
  std::unique_ptr<Path> best;
  for (Eigen::Index i = 0; i < starts.cols(); ++i) {
    auto path = std::make_unique<Path>(problem, starts.col(i), options);
    if (starts.cols() > 1) {
      path->go_on(std::min(options.trial, options.iterations), {});
    }
    if (!best || path->cost() < best->cost()) {
      best = std::move(path);
    }
  }
  best->go_on(options.iterations, callback);
  return best->solution();
}

}  // namespace touchfield
