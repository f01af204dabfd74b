#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "sim/cameras/pose_fit.h"
#include "sim/cameras/simulated_camera.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "sim/hand/hand.h"

namespace touchfield {

/// Three cameras of the D415 beside an array at its height, 0.34 m from a hand over it.
inline std::vector<CameraSpec> cameras_beside_array() {
  std::vector<CameraSpec> cameras(3);
  cameras[0].at = {0.28, -0.05, 0};
  cameras[1].at = {-0.28, -0.05, 0};
  cameras[2].at = {0, 0.27, 0};
  for (CameraSpec& camera : cameras) {
    camera.look_at = {0, -0.05, 0.215};
  }
  return cameras;
}

inline Box workspace_above_array() { return {Vector3(-0.3, -0.3, 0.05), Vector3(0.3, 0.3, 0.6)}; }

inline HandOptions hand_options(const HandShape& hand, double edge) {
  return {hand.pose, hand.breadth, hand.length, hand.side, edge, hand.joints, hand.forearm};
}

/// A hand over an array that goes round at 50 mm/s while its index finger flexes by up to 30 degrees a second.
class MovingHand {
 public:
  MovingHand(const HandShape& shape, double edge, const HandProportions& by = HandProportions::Zero(), double bump = 0)
      : hand_(std::make_shared<HandTemplate>(shape, edge)), shape_(hand_->shaped(by)) {
    const Vector3 pad = hand_landmark(hand_options(shape, edge), "index_pad");
    pad_ = hand_->carrier(pad);
    Points own;
    hand_->carry(shape_, shape_.skeleton, *pad_, own);
    anchor_ = own.col(0);
    if (bump > 0) {
      constexpr double kWidth = 10e-3;
      const Vector3 top = anchor_ - Vector3(0, 0.06, 0);
      const Eigen::VectorXd square = (shape_.rest.colwise() - top).colwise().squaredNorm();
      shape_ = hand_->shaped(by, (bump * (-0.5 / (kWidth * kWidth) * square).array().exp()).matrix());
    }
  }

  HandState state(double seconds) const {
    constexpr double kTurns = 2 * std::numbers::pi * 0.6;  // [rad/s]
    const double phase = kTurns * seconds;
    HandState state{{extrinsic_rotation(Vector3(5, -10, 15) * kDegree), {}}, joint_angles(hand_->pose())};
    const Vector3 at(0.05 / kTurns * std::sin(phase), 0.05 / kTurns * std::cos(phase), 0.2);
    state.place.shift = at - state.place.rotation * anchor_;
    const double flexed = 30 * kDegree / kTurns * (1 + std::sin(phase));
    state.joints(6) += 0.5 * flexed;
    state.joints(7) += flexed;
    return state;
  }
  TriangleMesh mesh(double seconds) const {
    const HandState now = state(seconds);
    Points points;
    hand_->carry(shape_, hand_->skeleton_at(shape_.proportions, now.joints), points);
    return {now.place(points), hand_->mesh().triangles()};
  }
  Vector3 index_pad(double seconds) const {
    const HandState now = state(seconds);
    Points point;
    hand_->carry(shape_, hand_->skeleton_at(shape_.proportions, now.joints), *pad_, point);
    return now.place(Vector3(point.col(0)));
  }

 private:
  std::shared_ptr<const HandTemplate> hand_;
  ShapedHand shape_;
  Vector3 anchor_;
  std::optional<HandTemplate::Carrier> pad_;
};

}  // namespace touchfield
