#include "solvers/phase/radiation.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "solvers/phase/skin_problem.h"
#include "solvers/phase/skin_rows.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXcf;
using Eigen::VectorXd;

constexpr double kFaintestFocus = 0.01;  // of the largest P': what the loudest face presses at least
constexpr double kFirstTilt = 0.3;       // [rad]: amplitudes begin at its cosine, as at 1 the cost has no slope
constexpr int kRandomStarts = 2;

void require_sizes(const RadiationProblem& problem, const std::string& who) {
  const RadiationSkin& skin = problem.skin;
  const Index rows = problem.rows.rows() + problem.outside.rows();
  if (problem.rows.cols() == 0 || skin.face_count() == 0) {
    throw std::invalid_argument(who + ": the problem needs at least one face and one channel");
  }
  if (!skin.slopes || skin.weights.size() != skin.face_count() || skin.slopes->rows() != 2 * skin.face_count() ||
      skin.slopes->cols() > problem.rows.rows() || skin.energies.size() != rows ||
      problem.rows.rows() < skin.face_count() ||
      (problem.outside.rows() > 0 && problem.outside.cols() != problem.rows.cols()) ||
      (skin.deviations.size() > 0 && skin.deviations.size() != skin.face_count())) {
    throw std::invalid_argument(who + ": sizes do not fit each other");
  }
}

/// P from pressures of either precision and their slopes, without deviations.
template <class Pressure>
VectorXd pressed(const RadiationSkin& skin, const Pressure& pressure, const Pressure& slopes) {
  VectorXd radiation(skin.face_count());
  for (Index j = 0; j < radiation.size(); ++j) {
    radiation(j) = skin.press * std::norm(std::complex<double>(pressure(j))) -
                   skin.flow * (std::norm(std::complex<double>(slopes(2 * j))) +
                                std::norm(std::complex<double>(slopes(2 * j + 1))));
  }
  return radiation;
}

double cost_of(const RadiationSkin& skin, const VectorXd& radiation, double energy) {
  return skin.weights.dot((radiation - skin.wanted).cwiseAbs2()) + energy + skin.constant;
}

/// a^2 at which the cost of a q is least, for what q makes.
double best_square(const RadiationSkin& skin, const VectorXd& radiation, double energy) {
  const VectorXd weighted = skin.weights.cwiseProduct(radiation);
  const double curvature = weighted.dot(radiation);
  return curvature > 0 ? (weighted.dot(skin.wanted) - 0.5 * energy) / curvature : 1.0;
}

/// v, by which the cost changes by 2 Re v^H dp with the pressures at level 1: of what they make there, in either
/// precision.
///
/// slopes   D
/// level    a^2
template <class Real>
auto push(const RadiationSkin& skin, const Eigen::SparseMatrix<Real, Eigen::RowMajor>& slopes,
          const Eigen::Vector<std::complex<Real>, Eigen::Dynamic>& pressure,
          const Eigen::Vector<std::complex<Real>, Eigen::Dynamic>& sloped, const VectorXd& radiation, double level) {
  const Index faces = skin.face_count();
  const VectorXd force = 2.0 * level * skin.weights.cwiseProduct(level * radiation - skin.wanted);  // dcost / dP
  Eigen::Vector<std::complex<Real>, Eigen::Dynamic> v =
      (level * skin.energies).template cast<Real>().cwiseProduct(pressure);
  Eigen::Vector<std::complex<Real>, Eigen::Dynamic> flows(2 * faces);
  for (Index j = 0; j < faces; ++j) {
    v(j) += static_cast<Real>(skin.press * force(j)) * pressure(j);
    flows(2 * j) = static_cast<Real>(-skin.flow * force(j)) * sloped(2 * j);
    flows(2 * j + 1) = static_cast<Real>(-skin.flow * force(j)) * sloped(2 * j + 1);
  }
  v.head(slopes.cols()) += slopes.transpose() * flows;
  return v;
}

/// What drives make, with the deviations.
struct Pressed {
  VectorXd radiation;
  double energy = 0.0;
};

VectorXcd pressure_by(const RadiationProblem& problem, const VectorXcd& q) {
  VectorXcd pressure(problem.rows.rows() + problem.outside.rows());
  pressure << problem.rows * q, problem.outside * q;
  return pressure;
}

Pressed pressed_by(const RadiationProblem& problem, const VectorXcd& q) {
  const RadiationSkin& skin = problem.skin;
  const VectorXcd pressure = pressure_by(problem, q);
  const double level = q.size() > 0 ? q.cwiseAbs2().maxCoeff() : 0.0;
  Pressed made{radiation_of(skin, pressure), skin.energies.dot(pressure.cwiseAbs2()) + level * skin.deviation_energy};
  if (skin.deviations.size() > 0) {
    made.radiation += level * skin.deviations;
  }
  return made;
}

}  // namespace

void require_valid(const RadiationProblem& problem, const char* who) {
  require_sizes(problem, who);
  const RadiationSkin& skin = problem.skin;
  if (!problem.rows.allFinite() || !problem.outside.allFinite() || !skin.wanted.allFinite() ||
      !skin.weights.allFinite() || !skin.energies.allFinite() || !std::isfinite(skin.constant)) {
    throw std::invalid_argument(std::string(who) + ": the problem holds a value that is not finite");
  }
  if ((skin.weights.array() < 0).any() || (skin.energies.array() < 0).any()) {
    throw std::invalid_argument(std::string(who) + ": weights and energies must be >= 0");
  }
}

void move_to(PhaseDevice& device, RadiationProblem& problem) {
  problem.device = device.skin(problem.rows.data(), static_cast<int>(problem.rows.rows()), problem.outside.data(),
                               static_cast<int>(problem.outside.rows()), static_cast<int>(problem.channel_count()));
}

VectorXd radiation_of(const RadiationSkin& skin, const VectorXcd& pressure) {
  return pressed<VectorXcd>(skin, pressure, skin.slopes->cast<double>() * pressure.head(skin.slopes->cols()));
}

double radiation_cost(const RadiationProblem& problem, const VectorXcd& q) {
  const Pressed made = pressed_by(problem, q);
  return cost_of(problem.skin, made.radiation, made.energy);
}

VectorXcd radiation_gradient(const RadiationProblem& problem, const VectorXcd& q) {
  const RadiationSkin& skin = problem.skin;
  if (skin.deviations.size() > 0) {
    throw std::invalid_argument("radiation_gradient: the problem has tolerances");
  }
  const Eigen::SparseMatrix<double, Eigen::RowMajor> slopes = skin.slopes->cast<double>();
  const VectorXcd pressure = pressure_by(problem, q);
  const VectorXcd sloped = slopes * pressure.head(slopes.cols());
  const VectorXcd v = push(skin, slopes, pressure, sloped, pressed(skin, pressure, sloped), 1.0);
  return 2.0 * (problem.rows.adjoint() * v.head(problem.rows.rows()) +
                problem.outside.adjoint() * v.tail(problem.outside.rows()));
}

double best_level(const RadiationProblem& problem, const VectorXcd& q) {
  const Pressed made = pressed_by(problem, q);
  const double loudest = q.size() > 0 ? q.cwiseAbs2().maxCoeff() : 0.0;
  const double limit = loudest > 0 ? 1.0 / loudest : 1.0;
  return std::sqrt(std::clamp(best_square(problem.skin, made.radiation, made.energy), 0.0, limit));
}

double silent_cost(const RadiationSkin& skin) { return skin.weights.dot(skin.wanted.cwiseAbs2()) + skin.constant; }

RadiationProblem with_tolerances(RadiationProblem problem, const ChannelTolerances& tolerances) {
  require_sizes(problem, "with_tolerances");
  const ChannelMoments moments = channel_moments(tolerances);
  RadiationSkin& skin = problem.skin;
  VectorXd strengths(problem.rows.rows() + problem.outside.rows());
  strengths << problem.rows.rowwise().squaredNorm(), problem.outside.rowwise().squaredNorm();
  const Eigen::SparseMatrix<double, Eigen::RowMajor> slopes = skin.slopes->cast<double>();
  const VectorXd slope_strengths = (slopes * problem.rows.topRows(slopes.cols())).rowwise().squaredNorm();
  skin.deviations.resize(skin.face_count());
  for (Index j = 0; j < skin.face_count(); ++j) {
    skin.deviations(j) = moments.variance * (skin.press * strengths(j) -
                                             skin.flow * (slope_strengths(2 * j) + slope_strengths(2 * j + 1)));
  }
  skin.deviation_energy = moments.variance * skin.energies.dot(strengths);
  problem.rows *= moments.mean;
  problem.outside *= moments.mean;
  problem.device.reset();
  return problem;
}

RadiationMisfit::Point RadiationMisfit::at(VectorXd phases) const {
  Point point;
  point.phases = std::move(phases);
  const Index channels = free_amplitudes_ ? point.phases.size() / 2 : point.phases.size();
  point.drives.resize(channels);
  for (Index n = 0; n < channels; ++n) {
    const double amplitude = free_amplitudes_ ? std::cos(point.phases(channels + n)) : 1.0;
    point.drives(n) = std::complex<float>(amplitude * std::polar(1.0, point.phases(n)));
  }
  point.pressure = map_.pressure(point.drives);
  point.slopes = *skin_.slopes * point.pressure.head(skin_.slopes->cols());
  point.radiation = pressed(skin_, point.pressure, point.slopes);
  if (skin_.deviations.size() > 0) {
    point.radiation += skin_.deviations;
  }
  const double energy = skin_.energies.dot(point.pressure.cwiseAbs2().cast<double>()) + skin_.deviation_energy;
  if (free_level_) {
    const double loudest = point.radiation.maxCoeff();
    const double least = loudest > 0 ? kFaintestFocus * skin_.wanted.maxCoeff() / loudest : 1.0;
    const double best = best_square(skin_, point.radiation, energy);
    point.level = std::min(1.0, std::max(best, least));
  }
  point.cost = cost_of(skin_, point.level * point.radiation, point.level * energy);
  return point;
}

VectorXd RadiationMisfit::gradient(const Point& point) const {
  const VectorXcf v = push(skin_, *skin_.slopes, point.pressure, point.slopes, point.radiation, point.level);
  const VectorXcd back = map_.sent_back(v).cast<std::complex<double>>();
  const Index channels = point.drives.size();
  VectorXd gradient(point.phases.size());
  for (Index n = 0; n < channels; ++n) {
    const std::complex<double> turned = std::conj(std::complex<double>(point.drives(n))) * back(n);
    gradient(n) = 2.0 * turned.imag();
    if (free_amplitudes_) {
      const std::complex<double> phasor = std::polar(1.0, point.phases(n));
      gradient(channels + n) = -2.0 * std::sin(point.phases(channels + n)) * (std::conj(phasor) * back(n)).real();
    }
  }
  return gradient;
}

PhaseSolution RadiationMisfit::solution(const Point& point, PhaseSolution solution) const {
  const Index channels = point.drives.size();
  solution.phases = point.phases.head(channels);
  solution.amplitudes = VectorXd::Ones(channels);
  if (free_amplitudes_) {
    const VectorXd cosines = point.phases.tail(channels).array().cos();
    for (Index n = 0; n < channels; ++n) {
      solution.phases(n) += cosines(n) < 0 ? std::numbers::pi : 0.0;
    }
    solution.amplitudes = cosines.cwiseAbs();
  }
  solution.phases = wrapped(solution.phases);
  solution.amplitudes *= std::sqrt(point.level);
  return solution;
}

PhaseSolution solve_radiation(const RadiationProblem& problem, const Eigen::MatrixXcd& starts,
                              const RadiationOptions& options, const IterationCallback& callback) {
  require_valid(problem, "solve_radiation");
  if (starts.cols() == 0 || starts.rows() != problem.channel_count() || !starts.allFinite()) {
    throw std::invalid_argument("solve_radiation: a start must hold one finite drive for each channel");
  }
  if (options.iterations < 1 || options.trial < 1 || !(options.standstill >= 0)) {
    throw std::invalid_argument("solve_radiation: an option is out of range");
  }
  const SkinRows rows(problem.rows, problem.outside, problem.device.get());
  const SkinMap map = rows.map();
  const RadiationMisfit misfit(map, problem.skin, options.free_level);
  std::optional<PhaseSolution> best;
  for (const auto& start : starts.colwise()) {
    PhaseSolution path;
    path.phases = start.cwiseArg();
    if (starts.cols() > 1) {
      PhaseDescent descent;
      path = descent.descend(misfit, path.phases, std::min(options.trial, options.iterations));
    }
    if (!best || path.cost_history.back() < best->cost_history.back()) {
      best = std::move(path);
    }
  }
  PhaseDescent descent;
  PhaseSolution solution = descent.descend(misfit, best->phases, options.iterations, {}, options.standstill, callback);
  if (!options.free_amplitudes) {
    return solution;
  }
  const RadiationMisfit freed(map, problem.skin, options.free_level, true);
  VectorXd angles(2 * problem.channel_count());
  angles << solution.phases, VectorXd::Constant(problem.channel_count(), kFirstTilt);
  PhaseDescent wider;
  PhaseSolution with_amplitudes = wider.descend(freed, angles, options.iterations, {}, options.standstill, callback);
  return with_amplitudes.cost_history.back() < solution.cost_history.back() ? with_amplitudes : solution;
}

Eigen::MatrixXcd radiation_starts(const RadiationProblem& problem) {
  require_valid(problem, "radiation_starts");
  Eigen::MatrixXcd starts(problem.channel_count(), 1 + kRandomStarts);
  const VectorXd amplitudes = problem.skin.weights.array() * problem.skin.wanted.array().max(0.0).sqrt();
  starts.col(0) = phasors_of(problem.rows.topRows(amplitudes.size()).adjoint() * amplitudes);
  for (int i = 0; i < kRandomStarts; ++i) {
    starts.col(1 + i) = random_start(problem.channel_count(), static_cast<unsigned>(i) + 1U);
  }
  return starts;
}

}  // namespace touchfield
