#pragma once

#include "sim/motion/moving_model.h"

namespace touchfield {

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
