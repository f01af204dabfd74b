#include "sim/mesh/raster/camera.h"

#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

void require_camera(const Camera& camera) {
  constexpr int kMostPixels = 16384;
  constexpr double kRotation = 1e-9;  // how far the axes may be from a rotation
  const auto require = [](bool holds, const char* member, const std::string& value, const char* rule) {
    if (!holds) {
      throw InputError(fmt::format("camera: {} = {}: must be {}", member, value, rule));
    }
  };
  const auto pixels = [&](int value, const char* member) {
    require(value >= 1 && value <= kMostPixels, member, std::to_string(value), "1 to 16384 pixels");
  };
  pixels(camera.width, "width");
  pixels(camera.height, "height");
  require(camera.eye.allFinite(), "eye", "nan or inf", "finite");
  require(camera.centre.allFinite(), "centre", "nan or inf", "finite");
  require((camera.axes.transpose() * camera.axes).isIdentity(kRotation) && camera.axes.determinant() > 0.0, "axes",
          "no rotation", "right, down, forward: unit, perpendicular, right-handed");
  for (const double focal : camera.focal) {
    require(focal > 0.0 && std::isfinite(focal), "focal", std::to_string(focal), "> 0");
  }
  const bool pinhole = camera.projection == Camera::Projection::kPinhole;
  require(pinhole ? camera.near > 0.0 && std::isfinite(camera.near) : camera.near < HUGE_VAL, "near",
          std::to_string(camera.near), pinhole ? "> 0 m" : "a number or -inf");
}

SeenPoints seen_points(const Camera& camera, const Points& points) {
  const Points local = camera.axes.transpose() * (points.colwise() - camera.eye);
  SeenPoints seen(4, points.cols());
  if (camera.projection == Camera::Projection::kPinhole) {
    seen.row(2) = local.row(2);
  } else {
    seen.row(2).setOnes();
  }
  for (int axis = 0; axis < 2; ++axis) {
    seen.row(axis) = camera.focal[axis] * local.row(axis) + camera.centre[axis] * seen.row(2);
  }
  seen.row(3) = local.row(2);
  return seen;
}

}  // namespace touchfield
