#pragma once

#include <memory>

#include <Eigen/Core>

#include "solvers/phase/phase_device.h"
#include "solvers/phase/phase_solution.h"

namespace touchfield {

/// The paper's misfit in the space of incident pressure,
///
///   cost(theta, phi) = || B_T diag(p') exp(i theta) - G exp(i phi) ||^2 = z^H Q z,   z = exp(i [theta; phi]),
///
/// Q = C^H C, C = [B_T diag(p'), -G]. Only Q is kept, so nothing here depends on the number of rows of C.
struct IncidentProblem {
  Eigen::MatrixXcd gram;      // Q, (K + N) x (K + N), Hermitian [Pa2]
  Eigen::Index target_count;  // K; the first K unknowns are theta
  std::shared_ptr<GramDevice>
      device{};  // that holds Q and works in the place of gram, which may then be empty; null: none

  Eigen::Index size() const { return device ? device->size() : gram.rows(); }
  Eigen::Index channel_count() const { return size() - target_count; }
};

/// product = Q z, both K + N.
void multiply_by_gram(const IncidentProblem& problem, const Eigen::VectorXcd& z, Eigen::VectorXcd& product);

/// The cost at the angles x = [theta; phi], K + N [rad].
double incident_cost(const IncidentProblem& problem, const Eigen::VectorXd& x);

/// J^T f of the real residual f = [Re C z; Im C z]: half the gradient of the cost, Re(conj(i z) .* (Q z)).
Eigen::VectorXd incident_half_gradient(const IncidentProblem& problem, const Eigen::VectorXd& x);

/// J^T J = Re(diag(conj z) Q diag(z)), from gram.
Eigen::MatrixXd incident_normal_matrix(const IncidentProblem& problem, const Eigen::VectorXd& x);

struct LevenbergMarquardtOptions {
  int iterations = kUsualIterations;  // steps tried, accepted or not; >= 1
  double initial_damping = 1e-3;      // tau: mu_0 = tau max diag(J^T J); > 0
  double gradient_tolerance = 1e-10;  // converged if max |J^T f| <= this times the cost; >= 0
  double step_tolerance = 1e-10;      // converged if |h| <= this (1 + |x|); >= 0
};

/// Minimises the cost over theta and phi by Levenberg-Marquardt with Madsen's damping (levenberg_marquardt.h) and the
/// gain ratio (cost - cost_new) / (h . (mu h - J^T f)). The cost never rises. A step's normal equations are factorised
/// in single precision and refined until the step is known to 1e-9 of itself; in double where that fails.
///
/// start     [theta; phi], K + N [rad]
/// returns   phi as the solution's phases, amplitudes 1; kStalled if no damping up to 1e30 times the start's helps
/// throws    std::invalid_argument on sizes that do not fit, options out of range, or a gram that is not finite
PhaseSolution solve_incident(const IncidentProblem& problem, const Eigen::VectorXd& start,
                             const LevenbergMarquardtOptions& options, const IterationCallback& callback = {});

}  // namespace touchfield
