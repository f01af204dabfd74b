#include "solvers/phase/surface.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include "solvers/phase/damped_step.h"
#include "solvers/phase/madsen_damping.h"
#include "solvers/phase/skin_jacobian.h"

namespace touchfield {

namespace {

using Complex = std::complex<double>;
// Share of the curvature of |q_n| = 1 that joins the linear model. The other part of what Gauss-Newton leaves out, from
// |u_j|, has the other sign and fewer rows: with all of the curvature the model is too stiff.
constexpr double kCurvature = 0.3;
constexpr double kFull = 1.0 - 1e-6;  // amplitudes from here on count as full drive
constexpr double kRounding = 1e-14;   // of the cost, a sum of thousands of squares
constexpr double kSettled = 0.003;    // an accepted step that lowers the cost by less lets the amplitudes go

void require_options(const SkinProblem& problem, const Eigen::VectorXcd& start, const SurfaceOptions& options) {
  if (start.size() != problem.channel_count()) {
    throw std::invalid_argument("solve_surface: the start has another size than the problem has channels");
  }
  if (!start.allFinite()) {
    throw std::invalid_argument("solve_surface: the start holds a value that is not finite");
  }
  if (options.iterations < 1 || !(options.initial_damping > 0) || !std::isfinite(options.initial_damping) ||
      !(options.gradient_tolerance >= 0) || !(options.step_tolerance >= 0) || !(options.cost_tolerance >= 0)) {
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

Point starting_point(const SkinProblem& problem, const Eigen::VectorXcd& start, bool free_amplitudes) {
  Point point;
  point.phases = start.unaryExpr([](Complex q) { return q == Complex(0.0) ? 0.0 : std::arg(q); }).real();
  point.amplitudes = Eigen::VectorXd::Ones(start.size());
  if (free_amplitudes) {
    point.amplitudes = start.cwiseAbs().cwiseMin(1.0);
  }
  point.evaluate(problem);
  return point;
}

/// Where Levenberg-Marquardt is, with the linear model there, in moves of the drives in their own frames (see
/// SkinJacobian). The model is |f + J h|^2 + h^T diag(curvature) h:
///
///   a channel held at full drive   moves along the tangent and back onto the circle, phi += atan(t); the circle's own
///                                  curvature is the outward pull of the cost, max(0, -Re(conj(q_n) g_n))
///   a free one                     moves in the plane; an outward pull is damped by pull / (1 - a), so that alone it
///                                  reaches the bound and does not pass it
class Surface {
 public:
  Surface(const SkinProblem& problem, const Eigen::VectorXcd& start, const SurfaceOptions& options)
      : problem_(problem),
        options_(options),
        point_(starting_point(problem, start, options.free_amplitudes)),
        candidate_(point_),
        jacobian_(problem),
        only_phases_((point_.amplitudes.array() == 1.0).all()) {
    linearise();
  }

  double cost() const { return point_.cost; }
  double largest_row() const { return jacobian_.largest_row(); }
  const Point& point() const { return point_; }

  bool is_flat() const { return gradient_.cwiseAbs().maxCoeff() <= options_.gradient_tolerance * point_.cost; }

  /// Finds the step at damping mu and the point that it leads to. False if there is none.
  bool try_step(double mu) {
    damping_ = curvature_.array() + mu;
    // What is left out of J^T J is less than the damping in every direction, far less in nearly all of them: that
    // changes the steps, not what they lead to.
    jacobian_.leave_out_up_to(mu);
    if (!solver_.solve(jacobian_, damping_, step_)) {
      return false;
    }
    const bool clipped = move();
    candidate_.evaluate(problem_);
    if (clipped) {
      jacobian_.apply(step_, moved_residual_);
      predicted_ =
          -2.0 * step_.dot(gradient_) - moved_residual_.squaredNorm() - step_.dot(curvature_.cwiseProduct(step_));
    } else {
      predicted_ = step_.dot(mu * step_ - gradient_);
    }
    return true;
  }

  bool lowers_cost() const { return candidate_.cost < point_.cost && predicted_ > 0; }
  bool promises_nothing() const { return std::abs(predicted_) <= kRounding * point_.cost; }
  bool is_tiny() const { return step_.norm() <= options_.step_tolerance * (1.0 + point_.phases.norm()); }

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
    const double gain = (point_.cost - candidate_.cost) / predicted_;
    std::swap(point_, candidate_);
    linearise();
    return gain;
  }

 private:
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
        curvature_(n) = kCurvature * push;
      } else {
        curvature_(where_radial_[static_cast<std::size_t>(n)]) = push / (1.0 - std::min(point_.amplitudes(n), kFull));
      }
    }
  }

  /// How fast half the cost falls with the amplitude of a channel.
  double outward(Eigen::Index n) const {
    return -(std::conj(point_.phasors(n)) * jacobian_.drive_gradient()(n)).real();
  }

  /// The candidate's phases and amplitudes. Returns whether an amplitude met its bound, the step is cut with it.
  bool move() {
    bool clipped = false;
    for (Eigen::Index n = 0; n < point_.phases.size(); ++n) {
      if (is_pinned(n)) {
        candidate_.phases(n) = point_.phases(n) + std::atan(step_(n));
        candidate_.amplitudes(n) = 1.0;
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
  Eigen::VectorXd moved_residual_;
  double predicted_ = 0.0;
};

/// One step tried. kIterationLimit: to be continued.
PhaseStatus tried(Surface& surface, MadsenDamping& damping, const SurfaceOptions& options) {
  const double before = surface.cost();
  const bool found = surface.try_step(damping.value());
  const bool tiny = found && surface.is_tiny();
  if (found && surface.lowers_cost()) {
    damping.accept(surface.accept());
    const double fall = before - surface.cost();
    if (tiny || surface.is_flat() || fall < options.cost_tolerance * before) {
      return PhaseStatus::kConverged;
    }
    if (fall < kSettled * before) {
      surface.free_amplitudes();
    }
    return PhaseStatus::kIterationLimit;
  }
  if (tiny || (found && surface.promises_nothing())) {
    // The cost cannot be told from its minimum's any more, unless a channel that is held could still move inwards.
    if (!surface.release_clipped()) {
      return PhaseStatus::kConverged;
    }
  } else if (found && surface.hold_clipped()) {
    return PhaseStatus::kIterationLimit;  // the same damping again, with these only turning
  }
  damping.reject();
  return damping.exhausted() ? PhaseStatus::kStalled : PhaseStatus::kIterationLimit;
}

}  // namespace

PhaseSolution solve_surface(const SkinProblem& problem, const Eigen::VectorXcd& start, const SurfaceOptions& options,
                            const IterationCallback& callback) {
  require_valid(problem, "solve_surface");
  require_options(problem, start, options);
  Surface surface(problem, start, options);
  MadsenDamping damping(options.initial_damping * surface.largest_row());

  PhaseSolution solution;
  const bool done = surface.is_flat() && !(surface.free_amplitudes() && !surface.is_flat());
  solution.status = done ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
  solution.cost_history.reserve(static_cast<std::size_t>(std::min(options.iterations, 1000)) + 1);
  solution.cost_history.push_back(surface.cost());
  iterate(solution, options.iterations, callback, [&](PhaseStatus& status) {
    status = tried(surface, damping, options);
    if (status != PhaseStatus::kIterationLimit && surface.free_amplitudes() && !surface.is_flat()) {
      status = PhaseStatus::kIterationLimit;  // only the phases had come to rest
      damping = MadsenDamping(options.initial_damping * surface.largest_row());
    }
    return surface.cost();
  });
  solution.phases = wrapped(surface.point().phases);
  solution.amplitudes = surface.point().amplitudes;
  return solution;
}

}  // namespace touchfield
