#pragma once

#include <Eigen/Geometry>

#include "sim/acoustics/transducer_array.h"
#include "sim/core/types.h"

namespace touchfield {

/// A rectangle of a picture [pixels]; x to the right, y up, from the lower left corner.
struct PixelBox {
  int x;
  int y;
  int width;
  int height;
};

/// A parallel projection into a panel of a picture.
struct SkinView {
  PixelBox panel;
  Vector3 direction;  // of sight, unit
  Vector3 up;         // unit, perpendicular to it
  Vector3 centre;     // [m], in the middle of the panel
  double scale;       // [m] a pixel

  Vector3 right() const { return direction.cross(up); }
  Eigen::Vector2d pixel(const Vector3& point) const;
};

/// The direction in which an array faces, its mean axis; for a plane wave its direction of travel. From the array to
/// `centre` where the axes cancel, +z where that fails too.
Vector3 facing(const TransducerArray& array, const Vector3& centre);

/// Looks along `direction`, with world +y up, or +x if +y is nearly the direction of sight. All points together fill
/// `share` of the panel in the tighter of its two sides.
SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Points& points, double share);

/// The same with another direction up.
/// vertical   not along `direction`
SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Vector3& vertical, const Points& points,
                     double share);

}  // namespace touchfield
