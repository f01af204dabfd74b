#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "sim/core/progress.h"
#include "sim/core/types.h"
#include "sim/hand/hand_contact.h"
#include "sim/hand/skinned_hand.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/model/model.h"
#include "sim/model/warnings.h"
#include "sim/scene/scene.h"
#include "sim/scene/varying_number.h"

namespace touchfield {

/// How the numbers of a scene that its motion changes run over time. The state is their values in SI units, in the
/// order of motion.change; paths are read once, here.
class Trajectory {
 public:
  /// scene    with a motion; without one nothing varies
  /// throws   InputError that names the path: it cannot vary, is not in this scene or there twice, or leaves its range
  ///          over the motion (and time and value)
  explicit Trajectory(const Scene& scene);

  Eigen::Index size() const { return static_cast<Eigen::Index>(curves_.size()); }
  const VaryingNumber& number(Eigen::Index i) const { return numbers_[static_cast<std::size_t>(i)]; }

  /// Values at a time of the motion.
  Eigen::VectorXd state(double seconds) const;

  /// Puts values into a posture of the scene that this was made of; the rest of it stays.
  void apply(const Eigen::VectorXd& state, Posture& posture) const;

  /// A state, such as an extrapolated one, with each value moved to the nearest one in its range.
  Eigen::VectorXd in_range(const Eigen::VectorXd& state) const;

 private:
  std::vector<VaryingNumber> numbers_;
  std::vector<MotionCurve> curves_;
};

/// A body given as meshes of the same triangles at several times, each file of them once in memory (24 bytes per
/// vertex). The state is its vertices, so that what predicts linearly in a Trajectory's state does so here.
class MeshSequence {
 public:
  /// shape    with a series
  /// throws   InputError that names the file, its time and what differs from the first file: how many vertices, how
  ///          many triangles, or the first triangle with other corners; if all files take more than half of the memory
  ///          that is free, before the second is read; if a mesh is not closed or inside out; also as read_mesh
  explicit MeshSequence(const MeshShape& shape);

  const Triangles& triangles() const { return triangles_; }

  /// Vertices at a time of the motion in the files' own frame [m]. They are linear in time between two meshes. Before
  /// the first mesh they are those of the first, after the last mesh those of the last.
  Points state(double seconds) const;

 private:
  /// Of the file at a time, by the time's number.
  const Points& vertices_at(std::size_t time) const { return vertices_[file_at_[time]]; }

  Triangles triangles_;
  std::vector<double> times_;
  std::vector<std::size_t> file_at_;  // of each time the number of its file
  std::vector<Points> vertices_;      // of each file
};

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
  bool deforms() const {
    return std::ranges::any_of(parts_, [](const Part& part) { return part.hand || part.series; });
  }

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
  MotionState in_range(MotionState state) const {
    state.numbers = trajectory_.in_range(state.numbers);
    return state;
  }

  /// The model at a state: its scene's numbers, mesh, boxes and own frame. If the state has a skin, that is the mesh,
  /// and boxes and landmarks follow it. Places and joints, and with them the own frame, are still those of the numbers.
  Model at(const MotionState& state) const;

  /// The evaluation mesh of a model that at() gave. There is none where the scene has no evaluation.
  std::optional<TriangleMesh> evaluation_mesh(const Model& model, const MotionState& state) const;

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

/// The true skin of a motion's bodies with what keep_within leaves out: what cameras look at. Its triangles are the
/// same all the time.
class WholeSkin {
 public:
  /// Edges, but of a body given as meshes over time, which keeps those of its files. A fingertip of 8 mm radius is then
  /// followed within 0.1 mm near the target and 0.2 mm elsewhere.
  static constexpr double kNearTarget = 2e-3;  // [m], within kWithin of a target's centre
  static constexpr double kFar = 3e-3;         // [m]
  static constexpr double kWithin = 15e-3;     // [m]

  /// first    the model as the motion begins
  /// kept     meshes of scenes before this one; may be null
  /// throws   InputError as build_bodies
  explicit WholeSkin(const Model& first, KeptBodies* kept = nullptr);

  /// In the world's frame.
  ///
  /// model, state   of one instant: MovingModel::at
  TriangleMesh at(const Model& model, const MotionState& state) const {
    return skin_.at(model.posture, model.plan, state);
  }

 private:
  MovingSkin skin_;
};

}  // namespace touchfield
