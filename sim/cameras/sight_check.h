#pragma once

#include <algorithm>
#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What depth images say of a skin that is thought to be somewhere.
struct SightCheck {
  /// How many cameras saw each vertex where it is thought to be,
  Eigen::VectorXd confirmed;
  /// how many looked past it at something farther,
  Eigen::VectorXd refuted;
  /// how many saw nothing there and nothing of a body beside it, 1 if it is in no camera's image,
  Eigen::VectorXd blank;
  /// and how many saw something nearer that is not of this skin.
  Eigen::VectorXd covered;
  /// How many vertices each camera saw where they are thought to be.
  std::vector<int> confirmed_by;

  /// Of what was seen at all vertices, the share that is theirs: 0 to 1. A pixel that saw nothing is no evidence.
  double share() const { return confirmed.sum() / std::max(confirmed.sum() + refuted.sum(), 1.0); }
  /// Whether a camera should have seen a vertex, and whether one did.
  bool said(Eigen::Index vertex) const {
    return confirmed(vertex) + refuted(vertex) + blank(vertex) + covered(vertex) > 0;
  }
  bool seen(Eigen::Index vertex) const { return confirmed(vertex) > 0; }
  /// Of the vertices that a camera should have seen, the share that one did.
  double evidence() const {
    double seen_by_one = 0;
    double said_of = 0;
    for (Eigen::Index v = 0; v < confirmed.size(); ++v) {
      seen_by_one += seen(v) ? 1 : 0;
      said_of += said(v) ? 1 : 0;
    }
    return seen_by_one / std::max(said_of, 1.0);
  }
};

/// Compares vertices with the images. A vertex counts for a camera if its normal is within 70 degrees of it. It is seen
/// if the depth at its pixel is its own within the tolerance, and refuted if that depth is greater. If the depth is
/// less, something hides the vertex. It is then covered, unless what hides it lies on the skin too. Where the nine
/// pixels round it saw nothing, the vertex is blank, unless
///
///   something nearer hides the vertex from the camera's second eye, which stands to the right of the first,
///   it is within 4 pixels of what was seen at its depth: outlines of stereo cameras lack as much, or
///   what was seen at its depth lies round it, in three of four directions within 40 pixels: a hole in a hand.
///
/// A camera that confirms less than a tenth of what another one does leaves no vertex blank or covered. It looks
/// elsewhere, or stands where it is not told to be.
///
/// vertices, normals   3 x V, in the world's frame [m], unit
/// tolerance           [m]
/// baseline            between a camera's eyes [m]
void check_sight(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const Points& vertices,
                 const Points& normals, double tolerance, double baseline, SightCheck& check);

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
