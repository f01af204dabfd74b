#include "sim/motion/trajectory.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

Trajectory::Trajectory(const Scene& scene) {
  if (!scene.motion) {
    return;
  }
  Scene still = scene;
  for (const MotionChange& change : scene.motion->changes) {
    VaryingNumber number = [&] {
      try {
        return varying_number(change.path);
      } catch (const InputError& error) {
        throw InputError(fmt::format("{} {}", change.path, error.what()));
      }
    }();
    require(std::ranges::find(numbers_, number.path, &VaryingNumber::path) == numbers_.end(),
            "{} is changed twice, must be changed once", number.path);
    curves_.push_back(motion_curve(number, change.law, scene.motion->seconds, still));
    numbers_.push_back(std::move(number));
  }
}

Eigen::VectorXd Trajectory::state(double seconds) const {
  Eigen::VectorXd values(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    values(i) = curves_[static_cast<std::size_t>(i)](seconds);
  }
  return values;
}

void Trajectory::apply(const Eigen::VectorXd& state, Posture& posture) const {
  for (Eigen::Index i = 0; i < size(); ++i) {
    number(i).in(posture) = state(i);
  }
}

Eigen::VectorXd Trajectory::in_range(const Eigen::VectorXd& state) const {
  Eigen::VectorXd values = state;
  for (Eigen::Index i = 0; i < size(); ++i) {
    const auto bound = [&](double written) { return number(i).unit.si(written); };
    const auto& [low, high, low_excluded] = number(i).range;
    if (low) {
      values(i) = std::max(values(i), bound(*low));
    }
    if (high) {
      values(i) = std::min(values(i), bound(*high));
    }
  }
  return values;
}

}  // namespace touchfield
