#include "sim/field/target_box.h"

#include <cmath>

namespace touchfield {

double level_at(const TargetBox& box, const Vector3& x) {
  const Vector3 own = in_box_frame(box, x);
  if (box.shape == TargetShape::kMask) {
    return box.mask ? box.level * box.mask->level(own) : 0.0;
  }
  const bool beside = box.shape == TargetShape::kCylinder
                          ? own.head<2>().norm() <= 0.5 * box.size.x()
                          : (own.head<2>().cwiseAbs().array() <= 0.5 * box.size.head<2>().array()).all();
  return beside && std::abs(own.z()) <= 0.5 * box.size.z() ? box.level : 0.0;
}

}  // namespace touchfield
