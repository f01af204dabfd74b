#pragma once

#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Signed distances over some area of a skin [m].
struct SkinDistance {
  double area = 0;  // that it is about [m2]; 0: nothing, and all below are 0
  double mean = 0;
  double rms = 0;
  double p95 = 0;   // 95 % of the area has no larger magnitude
  double most = 0;  // largest magnitude
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

}  // namespace touchfield
