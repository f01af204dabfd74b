#pragma once

#include <array>
#include <cstddef>

#include "sim/mesh/raster/camera.h"

namespace touchfield {

/// A convex polygon in the plane of a face; every plane that cuts it adds at most one corner.
struct ClippedFace {
  static constexpr std::size_t kMostCorners = 8;

  std::array<SeenPoint, kMostCorners> corners;
  std::size_t count = 0;
};

/// The part of a face that is no nearer than `near` [m] and seen at |u| <= guard, |v| <= guard. Where two faces share
/// an edge, both are cut at the same point of it, to the bit.
ClippedFace clipped(const std::array<SeenPoint, 3>& corners, double near, double guard);

}  // namespace touchfield
