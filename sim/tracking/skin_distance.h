#pragma once

#include <vector>

#include "sim/core/units.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/sensing/depth_camera.h"

namespace touchfield {

/// Signed distances over some area of a skin [m].
struct SkinDistance {
  double area = 0;  // that it is about [m2]; 0: nothing, and all below are 0
  double mean = 0;
  double rms = 0;
  double p95 = 0;   // 95 % of the area has no larger magnitude
  double most = 0;  // largest magnitude
};

/// How far a fitted skin is from the true one, where it matters. Only a simulation knows the true skin.
struct SkinError {
  SkinDistance seen;   // from the true skin that some camera sees to the fitted one
  SkinDistance patch;  // from the true skin round a point to the fitted one, seen or not
  SkinDistance all;    // from the whole true skin to the fitted one
  SkinDistance back;   // from the whole fitted skin to the true one: what the fit has too much shows here alone
};                     // in each, positive where the fitted skin is outside of the true one

/// The part of a skin that is judged by itself.
struct SkinPatch {
  Vector3 middle;  // [m]
  double radius;   // [m]; faces whose centroid is no farther
};

/// The distance from the centroid x of each face of `from` to the nearest point y of the faces of `to` [m]. Only faces
/// of `to` count that look the same way within 90 degrees. A finger is thus not taken for the one beside it or for its
/// own back. With n the normal of the face, the distance is positive if n . (y - x) > 0. `to` then lies outside of
/// `from` there. NaN where no face looks that way.
///
/// accuracy   exact at the centroids; some microseconds per face
Eigen::VectorXd signed_distances(const TriangleMesh& from, const TriangleMesh& to);

/// Area-weighted numbers of distances at the faces of a mesh of which keep[f] holds; empty keeps all.
///
/// distances   M; those that are NaN are left out
SkinDistance skin_distance(const TriangleMesh& mesh, const Eigen::VectorXd& distances, const std::vector<bool>& keep);

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
