#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A pinhole or orthographic camera. Columns of its image count from the left, rows from the top; the middle of pixel
/// (i, j) is at u = i + 0.5, v = j + 0.5.
///
/// A point x [m] has the camera's coordinates (X, Y, Z) = axes^T (x - eye) [m] and is seen at
///   pinhole        u = centre_u + focal_u X / Z, v = centre_v + focal_v Y / Z
///   orthographic   u = centre_u + focal_u X,     v = centre_v + focal_v Y
/// if Z, its depth, is at least `near`.
struct Camera {
  enum class Projection { kPinhole, kOrthographic };

  Projection projection = Projection::kPinhole;
  int width = 0;   // [pixels], 1 to 16384
  int height = 0;  // [pixels], 1 to 16384
  Vector3 eye = Vector3::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns: right, down, forward; a rotation
  Eigen::Vector2d focal = Eigen::Vector2d::Zero();     // > 0; pinhole [pixels], orthographic [pixels per metre]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();    // where the axis is seen [pixels]
  double near = 0.0;  // [m]; of a pinhole > 0, of an orthographic camera -infinity to see all
};

/// throws   InputError naming the member that is out of its range
void require_camera(const Camera& camera);

/// A point as a camera sees it: (U, V, W, Z) with u = U / W, v = V / W and the depth Z. Linear in the point: W is Z of
/// a pinhole and 1 of an orthographic camera.
using SeenPoint = Eigen::Vector4d;
using SeenPoints = Eigen::Matrix4Xd;

SeenPoints seen_points(const Camera& camera, const Points& points);

/// What a camera sees in the middle of every pixel, row by row from the upper left one.
struct Raster {
  static constexpr int kNothing = -1;

  int width = 0;              // [pixels]
  int height = 0;             // [pixels]
  std::vector<double> depth;  // Z of the nearest face [m], along the camera's axis; infinity where there is none
  std::vector<int> face;      // its number, or kNothing

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};

/// Draws faces, seen from either side, into a z-buffer. Of faces equally near, the one of the lowest number is seen.
///
/// A pixel belongs to a face if its middle does. A middle on an edge belongs to the face to the right of the edge, or
/// below a horizontal edge. Corners are put on a grid of 2^-14 pixels, and coverage is decided in whole numbers. Faces
/// that share an edge therefore leave no crack and share no pixel. The depth is that of the face itself and not of the
/// grid: exact to about 1e-12 of the distance, perspective-correct. The result does not depend on the number of
/// threads.
///
/// triangles   3 x M numbers of vertices; a face without area on the image is not seen
/// throws      InputError on a camera out of its ranges, a vertex [m] that is not finite, or a number without a vertex
Raster rasterise(const Camera& camera, const Points& vertices, const Triangles& triangles);

}  // namespace touchfield
