#pragma once

#include <memory>

#include <Eigen/Core>

#include "solvers/phase/phase_device.h"

namespace touchfield {

/// The misfit of amplitudes on the skin itself, for drives q of N channels:
///
///   cost(q) = sum_j w_j (|h_j q| - p'_j)^2 + ||R q||^2
///
/// h_j: rows of the transfer matrix at the K target faces; R^H R = w_Z H_Z^H diag(w) H_Z of the faces outside, of
/// numerical rank r. Levels are fixed: p' is what is wanted in Pa.
struct SkinProblem {
  Eigen::MatrixXcd target;     // H_T, K x N [Pa]
  Eigen::VectorXd amplitudes;  // p', K [Pa], >= 0
  Eigen::VectorXd weights;     // w, K, > 0 (areas [m2])
  Eigen::MatrixXcd outside;    // R, r x N [Pa m]; r may be 0. Fastest with orthogonal rows, the strongest first
  std::shared_ptr<SkinDevice> device{};  // that holds target and outside too and multiplies in their place; null: none

  Eigen::Index target_count() const { return target.rows(); }
  Eigen::Index channel_count() const { return target.cols(); }
};

/// throws   std::invalid_argument on sizes that do not fit, K or N of 0, a value that is not finite, a negative
///          amplitude or a weight that is not > 0; `who` begins the message
void require_valid(const SkinProblem& problem, const char* who);

/// Brings the problem's matrices to a device, which all methods then use; to be done again where they change.
void move_to(PhaseDevice& device, SkinProblem& problem);

}  // namespace touchfield
