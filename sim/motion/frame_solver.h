#pragma once

#include <memory>
#include <optional>

#include "sim/motion/motion_sensor.h"
#include "sim/solve/kept_models.h"
#include "sim/solve/methods.h"
#include "sim/store/motion_data.h"

namespace touchfield {

/// Drives that span what all channels do to a body wherever its sensor may see it (MotionSensor::places), N x r, to 5e-3
/// of b.
///
/// scheme     of the frames
/// progress   hears how far it is; may be null
Eigen::MatrixXcd drives_of_motion(const MotionSensor& sensor, Scheme scheme, Progress* progress = nullptr);

/// The same for a method, by its scheme, if it works on what all channels do to the whole skin; else nothing.
Eigen::MatrixXcd drives_for(const MotionSensor& sensor, const MethodSpec& method, Progress* progress = nullptr);

/// What is expected of phases that turn with a patch that moves: of channel n, at x_n,
///
///   phi_n - k (|x_n - now| - |x_n - before|)
///
/// The pattern goes along with the patch, but for how waves from each side bend on the skin.
Eigen::VectorXd steered(const Eigen::VectorXd& phases, const TransducerArray& array, const Wave& wave,
                        const Vector3& before, const Vector3& now);

/// Finds the phases of one method for a body that moves, a frame after the other, by the schemes, solvers and phase
/// methods of a still scene: motion.iterations steps from the frame before, steered, or from zero.
///
/// The body's equations are solved in single precision where the scene leaves that open. A body that keeps its shape has
/// one factorisation; one that keeps its place has one transfer matrix for all targets.
class FrameSolver {
 public:
  /// moving   what is solved
  /// method   of moving's scene
  /// drives   of drives_of_motion; empty: found anew in each frame
  FrameSolver(const MovingModel& moving, const MethodSpec& method, Eigen::MatrixXcd drives);

  /// Phases for a model that `moving` gave, whose times are the caller's to fill in. Where the target holds no skin the
  /// frame is quiet, and the next one starts from the last that was not.
  ///
  /// seconds   gets set_up, factorise, transfer, phases
  /// throws    NumericalError as MethodSolver
  MotionFrame solve(const Model& model);

  /// Of a sample that does not say where the body is: no drive sounds. The next frame starts from the last that was solved.
  MotionFrame lost() const;

  /// The largest relative residual that a frame's equations were left with.
  double worst_residual() const { return worst_residual_; }

 private:
  MotionFrame quiet() const;
  void set_up(const Model& model, const std::optional<Target>& target, MotionFrame& frame);

  const MovingModel& moving_;
  MethodSpec method_;
  SolverSpec solver_;
  std::shared_ptr<const Eigen::MatrixXcd> drives_;  // none: found anew in each frame
  KeptModels kept_;
  std::vector<SolveRecord> records_;
  Progress silent_;

  // Of the frame before:
  std::optional<RigidMotion> own_frame_;
  std::optional<Points> vertices_;
  std::optional<Points> beyond_;  // corners of skin that is not solved
  std::unique_ptr<SkinScattering> scattering_;
  std::unique_ptr<MethodSolver> methods_;
  Eigen::VectorXd phases_;
  Vector3 patch_ = Vector3::Zero();
  std::optional<double> scale_;  // on the target's amplitudes, of a scene that asks for the best
  double worst_residual_ = 0;
};

}  // namespace touchfield
