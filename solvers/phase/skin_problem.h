#pragma once

#include <memory>

#include <Eigen/Core>

#include "solvers/phase/phase_device.h"

namespace touchfield {

/// The misfit of amplitudes on the skin itself, for drives q of N channels:
///
///   cost(q) = sum_j w_j (|h_j q| - p'_j)^2 + ||R q||^2
///
/// h_j: rows of the transfer matrix at the K target faces; R^H R = w_Z H_Z^H diag(w) H_Z of the quiet faces, of
/// numerical rank r. Levels are fixed: p' is what is wanted in Pa.
struct SkinProblem {
  Eigen::MatrixXcd target;     // H_T, K x N [Pa]
  Eigen::VectorXd amplitudes;  // p', K [Pa], >= 0
  Eigen::VectorXd weights;     // w, K, > 0 (areas [m2])
  Eigen::MatrixXcd quiet;      // R, r x N [Pa m]; r may be 0. Fastest with orthogonal rows, the strongest first
  std::shared_ptr<SkinDevice> device{};  // that holds target and quiet too and multiplies in their place; null: none

  Eigen::Index target_count() const { return target.rows(); }
  Eigen::Index channel_count() const { return target.cols(); }
};

/// throws   std::invalid_argument on sizes that do not fit, K or N of 0, a value that is not finite, a negative
///          amplitude or a weight that is not > 0; `who` begins the message
void require_valid(const SkinProblem& problem, const char* who);

/// Brings the problem's matrices to a device, which all methods then use; to be done again where they change.
void move_to(PhaseDevice& device, SkinProblem& problem);

/// The cost of no sound at all, sum_j w_j p'_j^2.
double silent_cost(const SkinProblem& problem);

/// The cost at drives q (N).
double skin_cost(const SkinProblem& problem, const Eigen::VectorXcd& q);

/// Half the gradient of the cost along the phases of q = a exp(i phi): d cost / d phi = 2 x this, N. Where |h_j q| = 0
/// and p'_j > 0 the cost has a kink; a subgradient is taken there that is not zero if the face can be reached at all.
Eigen::VectorXd skin_half_gradient(const SkinProblem& problem, const Eigen::VectorXcd& q);

/// The level a in 0..1/max|q| at which cost(a q) is least, in closed form: the cost is quadratic in a. Of drives that
/// make no field at all, which leave it open, min(1, 1/max|q|).
double best_level(const SkinProblem& problem, const Eigen::VectorXcd& q);

}  // namespace touchfield
