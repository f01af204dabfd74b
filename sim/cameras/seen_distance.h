#pragma once

#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// How far what cameras saw lies from a skin.
struct SeenDistance {
  Eigen::VectorXd
      distance;  // M, mean over the cameras that saw the face, outside of the skin positive [m]; NaN for none
  Eigen::VectorXi cameras;  // M, how many saw it
};

/// Compares the faces of a skin with depth images. A camera saw a face under three conditions. The way from the
/// centroid x to the camera is within 75 degrees of the face's normal. x is in the image. The depth of its pixel is
/// within `reach` of that of x. With y the point that the pixel saw, the distance is n . (y - x).
///
/// reach    what lies farther off is of something else [m]
/// throws   InputError as require_frame
SeenDistance seen_distance(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const TriangleMesh& mesh,
                           double reach = 10e-3);

}  // namespace touchfield
