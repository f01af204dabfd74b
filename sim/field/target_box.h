#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/triangle_mesh.h"

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

/// What of a box belongs to the target.
enum class TargetShape {
  kBox,       // all of it
  kCylinder,  // the cylinder about its own z of diameter size.x
  kMask,      // the skin that its mask marks
};

/// A virtual box in space, or what it holds of a cylinder or of a mask. Its width axis is its own x, its depth axis its
/// own z.
struct TargetBox {
  Vector3 centre;                                          // [m]
  Vector3 size;                                            // side lengths along its own axes [m]
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // own axes as columns
  TargetShape shape = TargetShape::kBox;
  double level = 1.0;  // of the target's pressure, > 0 and <= 1
  std::string key{};   // what messages call the part of the target that it belongs to, with others of the same key;
                       // empty: a part of its own, by its number
  std::shared_ptr<const SkinMask> mask{};  // of kMask, in the box's own frame; null in a result, which does not keep it
};

/// The share of the target's pressure that a box asks for on the skin at x [m]: 0 where it does not hold x.
double level_at(const TargetBox& box, const Vector3& x);

/// A point in the box's own frame, from its centre.
inline Vector3 in_box_frame(const TargetBox& box, const Vector3& x) {
  return box.rotation.transpose() * (x - box.centre);
}

inline bool holds(const TargetBox& box, const Vector3& x) { return level_at(box, x) > 0; }

}  // namespace touchfield
