#pragma once

#include <memory>

#include <Eigen/Core>

#include "solvers/phase/phase_device.h"

namespace touchfield {

/// The misfit of amplitudes on the skin itself, for drives q of N channels:
///
///   cost(q) = sum_j w_j (|h_j q| - p'_j)^2 + ||R q||^2
///
/// h_j: rows of the transfer matrix at the K target faces, w_j the areas of the target on them;
/// R^H R = w_Z H^H diag(areas outside) H, of numerical rank r. Levels are fixed: p' is what is wanted in Pa.
struct SkinProblem {
  Eigen::MatrixXcd target;     // H_T, K x N [Pa]
  Eigen::VectorXd amplitudes;  // p', K [Pa], >= 0
  Eigen::VectorXd weights;     // w, K, > 0 (areas [m2])
  Eigen::MatrixXcd outside;    // R, r x N [Pa m]; r may be 0. Fastest with orthogonal rows, the strongest first
  std::shared_ptr<SkinDevice> device{};  // that holds target and outside too and multiplies in their place; null: none
  Eigen::VectorXd shares{};              // s, K: of each face in the target; empty: 1

  /// s p', the mean over each face: what methods for points want there, K [Pa].
  Eigen::VectorXd face_means() const { return shares.size() > 0 ? shares.cwiseProduct(amplitudes) : amplitudes; }

  Eigen::Index target_count() const { return target.rows(); }
  Eigen::Index channel_count() const { return target.cols(); }
};

/// throws   std::invalid_argument on sizes that do not fit, K or N of 0, a value that is not finite, a negative
///          amplitude or a weight that is not > 0; `who` begins the message
void require_valid(const SkinProblem& problem, const char* who);

/// Brings the problem's matrices to a device, which all methods then use; to be done again where they change.
void move_to(PhaseDevice& device, SkinProblem& problem);

/// One value per row of a SkinProblem. These are the pressure that drives make on the target and what they leave on the
/// skin outside the target. Or they are weights to send back through the rows.
struct SkinField {
  Eigen::VectorXcd target;   // K
  Eigen::VectorXcd outside;  // r
};

/// field = [H_T q; R q], or the first `outside_rows` rows of R alone. Allocates only where the field has another size
/// or the problem a device.
void send(const SkinProblem& problem, const Eigen::VectorXcd& q, SkinField& field);
void send(const SkinProblem& problem, const Eigen::VectorXcd& q, Eigen::Index outside_rows, SkinField& field);

/// x = H_T^H v_T + R^H v_Z; v_Z may have fewer entries than R has rows and is 0 from there on.
void send_back(const SkinProblem& problem, const SkinField& v, Eigen::VectorXcd& x);

/// x = R'^H v, R' the last rows of R, as many as v has entries.
void send_back_last(const SkinProblem& problem, const Eigen::VectorXcd& v, Eigen::VectorXcd& x);

/// sum_j w_j (|u_j| - p'_j)^2 + ||t||^2 of the field [u; t].
double field_cost(const SkinProblem& problem, const SkinField& field);

/// sum_n |h_jn|, the most that can reach each target face.
Eigen::VectorXd target_reach(const SkinProblem& problem);

/// sum_n |r_in|^2 of R's rows.
Eigen::VectorXd outside_strengths(const SkinProblem& problem);

/// u_j / |u_j|: the direction in which a change of u_j changes |u_j|.
///
/// In silence, |u_j| <= 1e-13 reach_j, |u_j| has a kink and every direction e^{i psi} is a subgradient. Taken is the
/// one along which turning the phases moves u_j most: psi = arg(sum_n c_n^2) / 2, c_n = i h_jn phasor_n, of the two the
/// one with Re(e^{-i psi} sum_n |c_n| c_n) >= 0. It turns with a common phase of the drives, and a face that only
/// rounding lights gives the same answer each time.
///
/// phasors   e^{i phi_n}, also of channels that are off
void pressure_directions(const SkinProblem& problem, const Eigen::VectorXd& reach, const SkinField& field,
                         const Eigen::VectorXcd& phasors, Eigen::VectorXcd& directions);

/// The cost of no sound at all, sum_j w_j p'_j^2.
double silent_cost(const SkinProblem& problem);

/// The cost at drives q (N).
double skin_cost(const SkinProblem& problem, const Eigen::VectorXcd& q);

/// The level a in 0..1/max|q| at which cost(a q) + added a^2 is least, in closed form: the sum is quadratic in a. Of
/// drives that make no field at all, which leave it open, min(1, 1/max|q|).
double best_level(const SkinProblem& problem, const Eigen::VectorXcd& q, double added = 0.0);

}  // namespace touchfield
