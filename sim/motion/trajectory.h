#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/scene/motion_curve.h"
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

}  // namespace touchfield
