#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/bem/scattering_solver.h"
#include "sim/core/progress.h"
#include "sim/motion/motion_sensor.h"
#include "sim/run/methods.h"
#include "sim/run/motion_data.h"
#include "sim/run/skin_scattering.h"
#include "sim/scene/scene.h"
#include "solvers/phase/phase_descent.h"

namespace touchfield {

/// A reduced basis of drives, N x r, orthonormal. It reproduces the effect of all channels on a body wherever its
/// sensor may see it (MotionSensor::places). It has as few vectors as leave at most 5e-3 of b out at each place, by
/// norm.
///
/// The basis is found from a sample of b's rows at every second place and checked by other rows at all places. While
/// the check fails, the places are taken twice as densely. A basis found from 33 places is used even if it fails.
///
/// scheme     of the frames
/// progress   hears how far it is; may be null
Eigen::MatrixXcd drives_of_motion(const MotionSensor& sensor, Scheme scheme, Progress* progress = nullptr);

/// The same for a method, by its scheme, if its frames work with them; else nothing.
Eigen::MatrixXcd drives_for(const MotionSensor& sensor, const MethodSpec& method, Progress* progress = nullptr);

/// The relative residual that frames are solved to: solve.tolerance, of Burton-Miller schemes at least 1e-3. That is a
/// fifth of what the reduced basis of a motion leaves out. Plain schemes magnify residuals near a resonance.
double frame_tolerance(const SolverSpec& scene, Scheme scheme);

/// What is expected of phases that turn with a patch that moves: of channel n, at x_n,
///
///   phi_n - k (|x_n - now| - |x_n - before|)
///
/// The pattern goes along with the patch, but for how waves from each side bend on the skin.
Eigen::VectorXd steered(const Eigen::VectorXd& phases, const TransducerArray& array, const Wave& wave,
                        const Vector3& before, const Vector3& now);

/// Finds the phases of one method for a body that moves, one frame after the other. It uses the schemes, solvers and
/// phase methods of a still scene. The first frame is solved as a still: with the method's own start and iterations.
/// Later ones take motion.iterations steps from the last frame that was not silent, steered. With motion.start: zero
/// every frame takes that many steps from zero.
///
/// The body's equations are solved in single precision where the scene leaves that open. A body that keeps its shape
/// has one factorisation. A body that keeps its place has one transfer matrix for all targets.
///
/// Some frames make no transfer matrix: those of `surface` and `radiation` that start from the one before on a
/// processor, by LU in single precision. They minimise the same cost by PhaseDescent on FactoredTransfer, with two
/// steps for each of motion.iterations. The residual is checked in the first frame alone, which is not one of them.
/// Methods with free amplitudes keep the transfer matrix, as do scenes with solve.outside_weight 0. So do meshes of
/// fewer than 1000 faces with all of the skin solved.
class FrameSolver {
 public:
  /// moving   what is solved
  /// method   of moving's scene
  /// drives   of drives_for; empty: found again in each frame that needs them
  FrameSolver(const MovingModel& moving, const MethodSpec& method, Eigen::MatrixXcd drives);

  /// Solves a first frame where, of nine places of the motion, the target first holds skin. The search of a start takes
  /// its time, so this is called before the clock starts.
  ///
  /// solved    gets its model; may be null
  /// returns   that frame; a silent one if no place has skin in the target
  MotionFrame begin(std::optional<Model>* solved = nullptr);

  /// Phases for a model that `moving` gave, whose times are the caller's to fill in. Where the target holds no skin the
  /// frame is silent, and the next one starts from the last that was not.
  ///
  /// seconds   gets set_up, factorise, transfer, phases
  /// throws    NumericalError as MethodSolver
  MotionFrame solve(const Model& model);
  /// Of moving's model at a state; seconds get `pose` before the others.
  ///
  /// solved   gets the model; may be null
  MotionFrame solve(const MotionState& state, std::optional<Model>* solved = nullptr);

  /// Of a sample that does not say where the body is: no drive sounds. The next frame starts from the last that was
  /// solved.
  MotionFrame lost() const {
    MotionFrame frame = silent_frame();
    frame.lost = true;
    return frame;
  }

  /// What the last frame that was solved makes of the skin of its model, M [Pa]. A frame that followed the one before
  /// has found it with its phases. Others take a product with the pressures of the drives, or one solve. Empty where
  /// the method does not solve the skin.
  ///
  /// accuracy   3 % with the drives of drives_for
  Eigen::VectorXcd pressure();

  /// The factor on the wanted pressures of a model's target: not 1 where the scene asks for the best ones.
  double scale() const { return scale_.value_or(1.0); }

  /// The largest relative residual that a frame's equations were left with.
  double worst_residual() const { return worst_residual_; }

 private:
  MotionFrame silent_frame() const {
    MotionFrame frame;
    frame.silent = true;
    frame.solution.phases = Eigen::VectorXd::Zero(moving_.first().fixed->array.size());
    frame.solution.amplitudes = frame.solution.phases;
    return frame;
  }
  /// Whether anything but the target has changed since the frame before.
  bool set_up(const Model& model, const std::optional<Target>& target, MotionFrame& frame);
  /// Products of the factored equations: the pressures of some faces, then those of all and of the skin beyond.
  SkinMap mapped(const std::vector<Eigen::Index>& first) const;
  PhaseSolution descended(const Model& model, const OutsideSkin& outside, const Target& target,
                          const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& before);
  PhaseSolution descended_by_radiation(const Model& model, const OutsideSkin& outside, const Target& target,
                                       const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& before);
  PhaseSolution followed(const Model& model, const Target& target, const Eigen::VectorXd& amplitudes,
                         const Eigen::VectorXd& before, bool moved, MotionFrame& frame);

  const MovingModel& moving_;
  MethodSpec first_;  // as the scene says
  MethodSpec later_;  // with motion.iterations, from zero where no phases are given
  SolverSpec solver_;
  std::shared_ptr<const Eigen::MatrixXcd> drives_;  // none: found again in each frame
  bool follows_;                                    // after the first solution
  KeptModels kept_;
  std::vector<SolveRecord> records_;
  Progress silent_;

  // Of the frame before:
  std::optional<RigidMotion> own_frame_;
  std::optional<Points> vertices_;
  std::optional<Points> beyond_;  // corners of skin that is not solved
  std::unique_ptr<SkinScattering> scattering_;
  std::unique_ptr<MethodSolver> methods_;
  Eigen::MatrixXcf incident_beyond_;            // of every channel on the patches that are not solved, J x N
  std::unique_ptr<FactoredTransfer> factored_;  // where frames follow
  std::optional<Points> factored_at_;
  PhaseDescent descent_;
  PhaseSolution found_;
  Vector3 patch_ = Vector3::Zero();
  std::optional<Eigen::VectorXcf> pressure_;  // of what followed, then of the skin that is not solved
  std::optional<double> scale_;               // on the target's amplitudes, of a scene that asks for the best
  double worst_residual_ = 0;
};

/// A way to compute a frame.
struct FrameSetting {
  double near_target = 0;  // edges at the target and beyond [m]
  double far = 0;
  Scheme scheme = Scheme::kChief;
  int steps = 0;
};

struct FrameChoice {
  FrameSetting setting;
  double milliseconds = 0;  // of a frame, as measured here
};

/// Chooses one of five settings, from the quickest to the most accurate. Each is tried with some frames of this scene
/// by its first method, until one takes too long. The choice is the last setting with frames of at most 0.7 of
/// motion.frame.budget_ms here, or else the quickest.
///
/// scene      with motion.frame
/// progress   hears of what takes its time; may be null
/// throws     as MovingModel and FrameSolver
FrameChoice choose_frame(const Scene& scene, Progress* progress = nullptr);

/// The scene with the setting that choose_frame chose, and a note of what that means; the scene itself without
/// motion.frame.
Scene within_budget(const Scene& scene, std::vector<std::string>& notes, Progress* progress = nullptr);

/// The scene with a setting in it: edges of every body that has some, scheme and iterations.
Scene with_setting(const Scene& scene, const FrameSetting& setting);

}  // namespace touchfield
