#pragma once

#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/core/units.h"
#include "sim/mesh/query/surface_fit.h"

namespace touchfield {

/// How far a fitted skin is from the true one, where it matters. Only a simulation knows the true skin.
struct SkinError {
  SkinDistance seen;   // from the true skin that some camera sees to the fitted one
  SkinDistance patch;  // from the true skin round a point to the fitted one, seen or not
  SkinDistance all;    // from the whole true skin to the fitted one
  SkinDistance back;   // from the whole fitted skin to the true one: what the fit has too much shows here alone
};                     // in each, positive where the fitted skin is outside of the true one

/// The part of a skin that is evaluated by itself.
struct SkinPatch {
  Vector3 middle;  // [m]
  double radius;   // [m]; faces whose centroid is no farther
};

/// The faces that some camera sees, without distortion. Their centroid is in its image, and the ray to it is within
/// `steepest` of the face's normal. No other face within 1.5 pixels is nearer by more than the depth of such a face.
///
/// steepest   [rad], below pi / 2; cameras have holes in what is steeper than 75 degrees
/// throws     InputError as rasterise does, or if `steepest` is out of its range
std::vector<bool> faces_seen(const std::vector<DepthCamera>& cameras, const TriangleMesh& mesh,
                             double steepest = 75 * kDegree);

/// seen   faces_seen of the true skin
SkinError skin_error(const TriangleMesh& truth, const TriangleMesh& fitted, const std::vector<bool>& seen,
                     const SkinPatch& patch);

}  // namespace touchfield
