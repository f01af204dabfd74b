#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/progress.h"
#include "sim/hand/hand_contact.h"
#include "sim/hand/skinned_hand.h"
#include "sim/model/model.h"
#include "sim/model/warnings.h"
#include "sim/motion/mesh_sequence.h"
#include "sim/motion/trajectory.h"

namespace touchfield {

/// What of a scene moves, at one instant: the numbers that its motion changes, and the vertices of a body that is given
/// as meshes over time. Or the whole solving mesh as a sensor sees it, wherever numbers and vertices have it.
struct MotionState {
  Eigen::VectorXd numbers;
  std::optional<Points> vertices{};  // in the body's own frame [m]
  std::optional<Points> skin{};      // in the world's frame [m]
  std::optional<Points> patches{};   // corners of those of skin that is not solved, beside `skin` [m]

  /// On the straight line through this state and an earlier one: this + share (this - before).
  MotionState beyond(const MotionState& before, double share) const;
};

/// A surface of a scene's bodies that keeps its triangles while they move. Hands with joints that turn are skinned.
/// Bodies given as meshes over time take the vertices of these. All others keep their shape in their own frame.
class MovingSkin {
 public:
  /// mesh     of all bodies in the world's frame, as the scene says at first
  /// owner    M: number of the body that a face is of, rising
  MovingSkin(const Scene& scene, const BodyPlan& plan, const TriangleMesh& mesh, const std::vector<int>& owner);

  /// Whether a body changes its shape.
  bool deforms() const;

  /// Where the skin of a hand whose joints turn cuts itself or is turned inside out.
  ///
  /// posture   as of at()
  std::optional<HandContact> fold(const Posture& posture, std::size_t body) const;

  /// The surface in the world's frame.
  ///
  /// posture   the first one with the numbers of this instant
  /// plan      of it: where the bodies' anchors are now
  TriangleMesh at(const Posture& posture, const BodyPlan& plan, const MotionState& state) const;

 private:
  struct Part {
    Eigen::Index begin = 0;  // of its vertices
    Triangles triangles;     // of its own vertices
    Points own;              // in the body's own frame, at first
    std::optional<SkinnedHand> hand;
    bool series = false;
  };

  Triangles triangles_;
  std::vector<Part> parts_;
};

/// A scene's model while it moves.
class MovingModel {
 public:
  /// Checks the whole motion as well, every 10 ms of it at which any number has moved by a thousandth of its range
  /// since they were there.
  ///
  /// scene    with a motion
  /// throws   InputError as build_model and Trajectory; where a path leads into the array or its boards, bodies into
  ///          each other, or fingers into contact, with the time
  /// kept       meshes of scenes before this one; may be null
  /// progress   hears of that check; may be null
  explicit MovingModel(const Scene& scene, KeptBodies* kept = nullptr, Progress* progress = nullptr);

  /// The model as the motion begins.
  const Model& first() const { return first_; }
  const Trajectory& trajectory() const { return trajectory_; }

  /// Remarks on the place of bodies and target relative to the array at later instants, if none was due at first. Each
  /// is of its worst instant.
  const Remarks& on_the_way() const { return on_the_way_; }

  /// Whether it is one body that keeps its shape, so that in its own frame nothing but array and target moves.
  bool is_rigid() const { return first_.posture.bodies.size() == 1 && !solving_.deforms(); }

  MotionState state(double seconds) const;
  /// A state, such as an expected one, with each of its numbers moved to the nearest one in its range.
  MotionState in_range(MotionState state) const;

  /// The model at a state: its scene's numbers, mesh, boxes and own frame. If the state has a skin, that is the mesh,
  /// and boxes and landmarks follow it. Places and joints, and with them the own frame, are still those of the numbers.
  Model at(const MotionState& state) const;

  /// The evaluation mesh of a model that at() gave. There is none where the scene has no evaluation.
  std::optional<EvaluationMesh> evaluation_mesh(const Model& model, const MotionState& state) const;

  /// The place of the wanted pattern on the skin [m]. It is the mean centre of the boxes where these follow the skin.
  /// Else it is the skin's point that was nearest to their mean centre at first. That point moves with the skin.
  Vector3 patch(const Model& model) const;

 private:
  BodyPlan plan_at(const Posture& posture) const;
  void check_motion(Progress& progress);
  /// The model at an instant at which it can be solved.
  Model checked_at(double seconds, const std::vector<std::optional<HandContacts>>& contacts) const;

  Model first_;
  Trajectory trajectory_;
  std::optional<MeshSequence> sequence_;
  MovingSkin solving_;
  std::optional<MovingSkin> evaluating_;
  std::optional<MovingSkin> beyond_;                 // the patches of skin that is not solved
  std::vector<std::optional<SkinnedHand>> anchors_;  // of bodies whose anchor moves with their joints
  Landmark patch_;
  Remarks on_the_way_;
};

/// Of a motion as it begins (played_remarks) and on its way.
Remarks moving_remarks(const MovingModel& moving);

}  // namespace touchfield
