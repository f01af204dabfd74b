#include "sim/pictures/skin_view.h"

#include <algorithm>
#include <cmath>

namespace touchfield {

Eigen::Vector2d SkinView::pixel(const Vector3& point) const {
  const Vector3 offset = (point - centre) / scale;
  return {panel.x + 0.5 * panel.width + offset.dot(right()), panel.y + 0.5 * panel.height + offset.dot(up)};
}

Vector3 facing(const TransducerArray& array, const Vector3& centre) {
  constexpr double kCancelled = 1e-3;  // of the mean of unit vectors: no direction is left in it
  const Vector3 axis = array.axes.rowwise().mean();
  if (axis.norm() > kCancelled) {
    return axis.normalized();
  }
  const Vector3 across = centre - array.positions.rowwise().mean();
  return across.norm() > 0 ? across.normalized() : Vector3::UnitZ();
}

SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Points& points, double share) {
  constexpr double kParallel = 0.99;
  return fitted_view(panel, direction, std::abs(direction.y()) < kParallel ? Vector3::UnitY() : Vector3::UnitX(),
                     points, share);
}

SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Vector3& vertical, const Points& points,
                     double share) {
  SkinView view{.panel = panel,
                .direction = direction,
                .up = (vertical - vertical.dot(direction) * direction).normalized(),
                .centre = Vector3::Zero(),
                .scale = 1.0};
  Eigen::Matrix3d frame;
  frame << view.right(), view.up, view.direction;
  const Points seen = frame.transpose() * points;
  const Vector3 low = seen.rowwise().minCoeff();
  const Vector3 high = seen.rowwise().maxCoeff();
  const Vector3 size = high - low;
  view.centre = frame * (0.5 * (low + high));
  view.scale = std::max(size.x() / panel.width, size.y() / panel.height) / share;
  return view;
}

}  // namespace touchfield
