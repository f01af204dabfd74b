#pragma once

#include <vector>

#include "sim/mesh/triangle_mesh.h"
#include "sim/sensing/depth_camera.h"

namespace touchfield {

/// What depth images say of a skin that is thought to be somewhere.
struct SightCheck {
  /// 1 for vertices that a camera saw where they are thought to be, else 0.
  Eigen::VectorXd seen;
  double confirmed = 0;  // vertices towards a camera that it saw there, counted camera by camera
  double refuted = 0;    // vertices towards a camera that looked past where they are thought to be, or saw nothing

  /// Of what could be said: 0 to 1.
  double share() const { return confirmed / std::max(confirmed + refuted, 1.0); }
};

/// Holds vertices against the images: a vertex whose normal is within 70 degrees of a camera is seen if the depth at its
/// pixel is its own within the tolerance, refuted if that is greater, or if the nine pixels round it saw nothing. If it is
/// less something hides the vertex, which says nothing.
///
/// vertices, normals   3 x V, in the world's frame [m], unit
/// tolerance           [m]
void check_sight(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const Points& vertices,
                 const Points& normals, double tolerance, SightCheck& check);

}  // namespace touchfield
