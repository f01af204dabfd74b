#include "solvers/phase/skin_problem.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>
#include <string>

#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

void require(bool holds, const char* who, const char* rule) {
  if (!holds) {
    throw std::invalid_argument(std::string(who) + ": " + rule);
  }
}

constexpr double kSilence = 1e-13;  // some hundred roundings of a sum of N = 1,500 terms of both signs

std::complex<double> silent_direction(const SkinProblem& problem, Eigen::Index j, const Eigen::VectorXcd& phasors) {
  std::complex<double> squares = 0.0;
  std::complex<double> leaning = 0.0;
  for (Eigen::Index n = 0; n < phasors.size(); ++n) {
    const std::complex<double> c = std::complex<double>(0, 1) * problem.target(j, n) * phasors(n);
    squares += c * c;
    leaning += std::abs(c) * c;
  }
  const std::complex<double> direction = std::polar(1.0, 0.5 * std::arg(squares));
  return (std::conj(direction) * leaning).real() < 0 ? -direction : direction;
}

}  // namespace

void require_valid(const SkinProblem& problem, const char* who) {
  const Eigen::Index faces = problem.target_count();
  const Eigen::Index channels = problem.channel_count();
  require(faces > 0 && channels > 0, who, "the problem needs at least one target face and one channel");
  require(problem.amplitudes.size() == faces && problem.weights.size() == faces &&
              (problem.shares.size() == 0 || problem.shares.size() == faces),
          who, "amplitudes, weights and shares must hold one value for each row of target");
  require(problem.outside.rows() == 0 || problem.outside.cols() == channels, who,
          "outside must have as many columns as target");
  // LAPACK counts in int; the small system has K + 2 r rows.
  require(faces + 2 * problem.outside.rows() <= std::numeric_limits<int>::max() &&
              channels <= std::numeric_limits<int>::max() / 2,
          who, "the problem has too many rows or channels");
  const bool finite =
      problem.device
          ? Eigen::Map<const Eigen::VectorXd>(problem.device->reach(), faces + problem.outside.rows()).allFinite()
          : problem.target.allFinite() && problem.outside.allFinite();
  require(finite, who, "target or outside holds a value that is not finite");
  require(problem.amplitudes.allFinite() && (problem.amplitudes.array() >= 0).all(), who,
          "amplitudes must be finite and >= 0");
  require(problem.weights.allFinite() && (problem.weights.array() > 0).all(), who, "weights must be finite and > 0");
}

void move_to(PhaseDevice& device, SkinProblem& problem) {
  problem.device = device.skin(problem.target.data(), static_cast<int>(problem.target.rows()), problem.outside.data(),
                               static_cast<int>(problem.outside.rows()), static_cast<int>(problem.channel_count()));
}

void send(const SkinProblem& problem, const Eigen::VectorXcd& q, SkinField& field) {
  send(problem, q, problem.outside.rows(), field);
}

void send(const SkinProblem& problem, const Eigen::VectorXcd& q, Eigen::Index outside_rows, SkinField& field) {
  field.target.resize(problem.target.rows());
  field.outside.resize(outside_rows);
  if (problem.device) {
    Eigen::VectorXcd sent(field.target.size() + outside_rows);
    problem.device->send(q.data(), static_cast<int>(sent.size()), sent.data());
    field.target = sent.head(field.target.size());
    field.outside = sent.tail(outside_rows);
    return;
  }
  multiply(Op::kPlain, problem.target, q, 0.0, field.target);
  if (outside_rows > 0) {
    multiply(Op::kPlain, problem.outside.topRows(outside_rows), q, 0.0, field.outside);
  }
}

void send_back(const SkinProblem& problem, const SkinField& v, Eigen::VectorXcd& x) {
  x.resize(problem.channel_count());
  if (problem.device) {
    Eigen::VectorXcd both(v.target.size() + v.outside.size());
    both << v.target, v.outside;
    problem.device->send_back(both.data(), 0, static_cast<int>(both.size()), x.data());
    return;
  }
  multiply(Op::kAdjoint, problem.target, v.target, 0.0, x);
  if (v.outside.size() > 0) {
    multiply(Op::kAdjoint, problem.outside.topRows(v.outside.size()), v.outside, 1.0, x);
  }
}

void send_back_last(const SkinProblem& problem, const Eigen::VectorXcd& v, Eigen::VectorXcd& x) {
  x.resize(problem.channel_count());
  if (problem.device) {
    problem.device->send_back(v.data(), static_cast<int>(problem.target_count() + problem.outside.rows() - v.size()),
                              static_cast<int>(v.size()), x.data());
    return;
  }
  multiply(Op::kAdjoint, problem.outside.bottomRows(v.size()), v, 0.0, x);
}

double field_cost(const SkinProblem& problem, const SkinField& field) {
  const auto misfit = field.target.array().abs() - problem.amplitudes.array();
  return (problem.weights.array() * misfit.square()).sum() + field.outside.squaredNorm();
}

Eigen::VectorXd target_reach(const SkinProblem& problem) {
  if (problem.device) {
    return Eigen::Map<const Eigen::VectorXd>(problem.device->reach(), problem.target_count());
  }
  return problem.target.cwiseAbs().rowwise().sum();
}

Eigen::VectorXd outside_strengths(const SkinProblem& problem) {
  if (problem.device) {
    return Eigen::Map<const Eigen::VectorXd>(problem.device->strengths() + problem.target_count(),
                                             problem.outside.rows());
  }
  return problem.outside.rowwise().squaredNorm();
}

void pressure_directions(const SkinProblem& problem, const Eigen::VectorXd& reach, const SkinField& field,
                         const Eigen::VectorXcd& phasors, Eigen::VectorXcd& directions) {
  directions.resize(field.target.size());
  for (Eigen::Index j = 0; j < directions.size(); ++j) {
    const double magnitude = std::abs(field.target(j));
    directions(j) =
        magnitude > kSilence * reach(j) ? field.target(j) / magnitude : silent_direction(problem, j, phasors);
  }
}

double silent_cost(const SkinProblem& problem) { return problem.weights.dot(problem.amplitudes.cwiseAbs2()); }

double skin_cost(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  SkinField field;
  send(problem, q, field);
  return field_cost(problem, field);
}

double best_level(const SkinProblem& problem, const Eigen::VectorXcd& q, double added) {
  SkinField field;
  send(problem, q, field);
  const auto loudness = field.target.array().abs();
  const double wanted = (problem.weights.array() * problem.amplitudes.array() * loudness).sum();
  const double energy = (problem.weights.array() * loudness.square()).sum() + field.outside.squaredNorm() + added;
  const double loudest = q.size() > 0 ? q.cwiseAbs().maxCoeff() : 0.0;
  const double limit = loudest > 0 ? 1.0 / loudest : std::numeric_limits<double>::infinity();
  return energy > 0 ? std::min(wanted / energy, limit) : std::min(1.0, limit);
}

}  // namespace touchfield
