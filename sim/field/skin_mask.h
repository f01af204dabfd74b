#pragma once

#include <utility>
#include <vector>

#include "sim/mesh/query/face_tree.h"

namespace touchfield {

/// Levels of the faces of a surface, and with them of any mesh of the same skin.
class SkinMask {
 public:
  static constexpr double kReach = 3e-3;  // [m]: what is farther from the surface is no skin of it

  /// levels   one per face, 0 to 1
  SkinMask(const TriangleMesh& surface, std::vector<double> levels) : tree_(surface), levels_(std::move(levels)) {}

  /// The level of the face that is nearest to x [m]; 0 if none is within kReach.
  double level(const Vector3& x) const {
    const SkinPoint nearest = tree_.nearest(x, kReach);
    return nearest.face < 0 ? 0.0 : levels_[static_cast<std::size_t>(nearest.face)];
  }

 private:
  FaceTree tree_;
  std::vector<double> levels_;
};

}  // namespace touchfield
