#pragma once

#include <vector>

#include "sim/mesh/triangle_mesh.h"
#include "sim/sensing/depth_camera.h"

namespace touchfield {

/// What depth images say of a skin that is thought to be somewhere.
struct SightCheck {
  /// How many cameras saw each vertex where it is thought to be,
  Eigen::VectorXd confirmed;
  /// and how many looked past it, or saw nothing there.
  Eigen::VectorXd refuted;
  /// How many vertices each camera saw where they are thought to be.
  std::vector<int> confirmed_by;

  /// Of what could be said of all vertices: 0 to 1.
  double share() const { return confirmed.sum() / std::max(confirmed.sum() + refuted.sum(), 1.0); }
};

/// Holds vertices against the images: a vertex whose normal is within 70 degrees of a camera is seen if the depth at its
/// pixel is its own within the tolerance, refuted if that is greater, or if the nine pixels round it saw nothing. If it is
/// less something hides the vertex, which says nothing; nor does a pixel that saw nothing where something nearer hides the
/// vertex from the camera's second eye, which stands to the right of the first.
///
/// vertices, normals   3 x V, in the world's frame [m], unit
/// tolerance           [m]
/// baseline            between a camera's eyes [m]
void check_sight(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const Points& vertices,
                 const Points& normals, double tolerance, double baseline, SightCheck& check);

}  // namespace touchfield
