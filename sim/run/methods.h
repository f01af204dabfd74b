#pragma once

#include <map>
#include <memory>
#include <optional>

#include "sim/field/radiation_skin.h"
#include "sim/field/skin_problems.h"
#include "sim/field/target.h"
#include "sim/run/skin_scattering.h"
#include "sim/run/transfer.h"
#include "solvers/phase/incident_problem.h"
#include "solvers/phase/phase_device.h"
#include "solvers/phase/phase_solution.h"

namespace touchfield {

/// Patterns that are tried for the best pressure: narrows 1/50 to 1 of the largest one to a factor of 1.09.
constexpr int kScaleTrials = 9;

/// G^H diag(w) G of every channel's field G on the skin, N x N, for each kind of weights: made when first needed.
using IncidentGrams = std::map<FaceWeights, Eigen::MatrixXcd>;

/// A channel that the solver knows to be dead has no bearing on any cost: it is not driven.
void leave_out_dead(const ChannelResponse& response, PhaseSolution& solution);

/// throws   InputError if given drives, or the phases of the run that the method starts from, do not fit the channels,
///          or that run cannot be read
void require_fitting_phases(const MethodSpec& method, Eigen::Index channels);
/// The same of every method of a model's scene.
void require_fitting_phases(const Model& model);

/// Solves the phase methods of a scene on one scattering model. What several methods share (b of every channel, its
/// Gram matrix, columns of B, the transfer matrix) is computed once, when the first one needs it.
class MethodSolver {
 public:
  /// scattering   outlives the solver
  /// target       absent for scenes without one; methods other than `fixed` need one
  /// outside      of the scattering's mesh
  /// grams        of the incident pressures, shared with solvers of the same mesh, array and skin beyond
  MethodSolver(SkinScattering& scattering, Eigen::Index channels, std::optional<Target> target, SolveSpec spec,
               OutsideSkin outside = {}, std::shared_ptr<IncidentGrams> grams = std::make_shared<IncidentGrams>());

  SkinScattering& scattering() const { return scattering_; }

  /// Reduces what the channels do to the body by these drives, N x r, which must span it well enough. Keeps the
  /// pressures of the drives for every target that follows.
  void span(std::shared_ptr<const Eigen::MatrixXcd> drives) { drives_ = std::move(drives); }

  /// Another target on the same body.
  void aim(Target target);

  /// The drives that a method finds for wanted amplitudes p' on the target's faces, K [Pa] (empty without a target).
  /// Channels that the solver knows to be dead are not driven, but by drives that are given.
  ///
  /// before   drives that a method which iterates starts from instead of its own start, N; may be null
  /// throws   NumericalError if a matrix of the problem is not finite; InputError on given drives or a previous run
  ///          that do not fit
  PhaseSolution solve(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress,
                      const Eigen::VectorXcd* before = nullptr);

  /// What drives make of the faces, M [Pa]: by the pressures of span()'s drives where these are known, else solved.
  Eigen::VectorXcd pressure(const Eigen::VectorXcd& drives);

  /// The problem of the methods on the skin, for wanted amplitudes p': with its outside rows if one of them or the
  /// optimality bound includes them.
  const SkinProblem& skin_problem(const Eigen::VectorXd& amplitudes, Progress& progress);

  /// That of method radiation, without its tolerances.
  RadiationProblem radiation_problem(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress);

  /// The transfer matrix with its outside rows, as run.h5 keeps it.
  RunTransfer run_transfer(const Eigen::VectorXd& amplitudes, Progress& progress);

  /// The largest pressure that the channels can make on the target's central face: all of them in phase there [Pa].
  double most_pressure() { return central_row().cwiseAbs().sum(); }

  /// The factor on the target's amplitudes for a scene that asks for the best pressure. At this factor `method` reaches
  /// the lowest relative error of |p| after its own best scale. A method that iterates is solved again at each trial of
  /// a golden-section search, over 1/50 to 1 of most_pressure. The others get the one at which they fit best.
  ///
  /// mesh     in the frame of the boxes
  /// throws   InputError if a method that does not iterate is silent
  double best_scale(const MethodSpec& method, const TriangleMesh& mesh, const std::vector<TargetBox>& boxes,
                    Progress& progress);

 private:
  PhaseSolution found(const MethodSpec& method, const Eigen::VectorXd& amplitudes, Progress& progress,
                      const Eigen::VectorXcd* before);
  PhaseSolution solve_incident_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                      const Eigen::VectorXcd* before, const IterationCallback& advance);
  PhaseSolution solve_skin_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                  const Eigen::VectorXcd* before, const IterationCallback& advance, Progress& progress);
  PhaseSolution solve_radiation_method(const MethodSpec& method, const Eigen::VectorXd& amplitudes,
                                       const Eigen::VectorXcd* before, Progress& progress);
  Eigen::VectorXd face_means(const Eigen::VectorXd& amplitudes) const;
  IncidentProblem unscattered(const Eigen::VectorXd& amplitudes, FaceWeights faces);
  IncidentProblem scattered(const Eigen::VectorXd& amplitudes, FaceWeights faces);
  const Eigen::MatrixXcd& weighted_gram_of(const Eigen::MatrixXcd& g, const Eigen::VectorXd& weights, FaceWeights faces,
                                           IncidentGrams& kept) const;
  const Transfer& transfer(const Eigen::VectorXd& amplitudes, double outside_weight, Progress& progress);
  const Eigen::RowVectorXcd& central_row();

  SkinScattering& scattering_;
  Eigen::Index channels_;
  std::optional<Target> target_;
  SolveSpec spec_;
  OutsideSkin outside_;
  std::shared_ptr<IncidentGrams> gram_free_;        // of the incident pressures, those beyond among them
  std::shared_ptr<const Eigen::MatrixXcd> drives_;  // given to span(), or none
  bool leave_card_ = false;                         // for want of memory there
  // Empty until needed:
  std::optional<SpannedPressure> spanned_;  // of drives_
  std::optional<Transfer> transfer_;
  NearSkin near_;                    // of the target, where a method asks for it
  Eigen::MatrixXcd b_;               // of every channel, where it is not the incident pressure
  IncidentGrams gram_b_;             // as gram_free_
  Eigen::MatrixXcd columns_;         // B_T
  Eigen::RowVectorXcd central_row_;  // of H
};

}  // namespace touchfield
