#include "solvers/phase/skin_problem.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>
#include <string>

#include "solvers/phase/skin_field.h"

namespace touchfield {

namespace {

void require(bool holds, const char* who, const char* rule) {
  if (!holds) {
    throw std::invalid_argument(std::string(who) + ": " + rule);
  }
}

}  // namespace

void require_valid(const SkinProblem& problem, const char* who) {
  const Eigen::Index faces = problem.target_count();
  const Eigen::Index channels = problem.channel_count();
  require(faces > 0 && channels > 0, who, "the problem needs at least one target face and one channel");
  require(problem.amplitudes.size() == faces && problem.weights.size() == faces, who,
          "amplitudes and weights must hold one value for each row of target");
  require(problem.quiet.rows() == 0 || problem.quiet.cols() == channels, who,
          "quiet must have as many columns as target");
  // LAPACK counts in int; the small system has K + 2 r rows.
  require(faces + 2 * problem.quiet.rows() <= std::numeric_limits<int>::max() &&
              channels <= std::numeric_limits<int>::max() / 2,
          who, "the problem has too many rows or channels");
  const bool finite =
      problem.device
          ? Eigen::Map<const Eigen::VectorXd>(problem.device->reach(), faces + problem.quiet.rows()).allFinite()
          : problem.target.allFinite() && problem.quiet.allFinite();
  require(finite, who, "target or quiet holds a value that is not finite");
  require(problem.amplitudes.allFinite() && (problem.amplitudes.array() >= 0).all(), who,
          "amplitudes must be finite and >= 0");
  require(problem.weights.allFinite() && (problem.weights.array() > 0).all(), who, "weights must be finite and > 0");
}

void move_to(PhaseDevice& device, SkinProblem& problem) {
  problem.device = device.skin(problem.target.data(), static_cast<int>(problem.target.rows()), problem.quiet.data(),
                               static_cast<int>(problem.quiet.rows()), static_cast<int>(problem.channel_count()));
}

double silent_cost(const SkinProblem& problem) { return problem.weights.dot(problem.amplitudes.cwiseAbs2()); }

double skin_cost(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  SkinField field;
  send(problem, q, field);
  return field_cost(problem, field);
}

Eigen::VectorXd skin_half_gradient(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  SkinField field;
  send(problem, q, field);
  Eigen::VectorXcd directions;
  const Eigen::VectorXcd phasors =
      q.unaryExpr([](std::complex<double> drive) { return std::polar(1.0, std::arg(drive)); });
  pressure_directions(problem, target_reach(problem), field, phasors, directions);
  field.target =
      problem.weights.array() * (field.target.array().abs() - problem.amplitudes.array()) * directions.array();
  Eigen::VectorXcd x;
  send_back(problem, field, x);
  return (q.array().conjugate() * x.array()).imag();  // Re(conj(i q) x)
}

double best_level(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  SkinField field;
  send(problem, q, field);
  const auto loudness = field.target.array().abs();
  const double wanted = (problem.weights.array() * problem.amplitudes.array() * loudness).sum();
  const double energy = (problem.weights.array() * loudness.square()).sum() + field.quiet.squaredNorm();
  const double loudest = q.size() > 0 ? q.cwiseAbs().maxCoeff() : 0.0;
  const double limit = loudest > 0 ? 1.0 / loudest : std::numeric_limits<double>::infinity();
  return energy > 0 ? std::min(wanted / energy, limit) : std::min(1.0, limit);
}

}  // namespace touchfield
