#pragma once

#include <algorithm>
#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/core/box_tree.h"
#include "sim/core/units.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// throws   InputError if the frame has not an image a camera or an image not its camera's size
void require_frame(const std::vector<DepthCamera>& cameras, const DepthFrame& frame);

/// Points of a skin that cameras saw, in the world's frame.
struct HandPoints {
  Points at;                // 3 x N [m]
  Points normal;            // 3 x N, unit, out of the skin: towards the camera
  std::vector<int> camera;  // that saw it
  Eigen::VectorXd sigma;    // expected depth noise [m] along the camera's ray

  Eigen::Index size() const { return at.cols(); }
};

struct PointOptions {
  int most = 2000;                 // points per camera, >= 1
  double window = 2.5e-3;          // half the width on the skin over which a normal is fitted [m]
  double baseline = 55e-3;         // between a camera's two eyes [m]
  double disparity_noise = 0.08;   // [pixels], rms
  double steepest = 75 * kDegree;  // between normal and ray [rad]; points of steeper surfaces are dropped
};

/// Turns depth images into points with normals.
///
/// Of each image a regular grid of pixels is taken, each other row shifted by half its spacing, as dense as `most`
/// allows. A pixel is kept if its point lies in the box and the eight pixels round it saw the same surface. None of
/// them may be empty, or farther off in depth than a surface at the steepest angle and four deviations of noise allow.
/// So edges and what flies between a near and a far surface are dropped.
///
///   at       along the pixel's ray, at 1 / Z = 3/2 (mean of 1 / Z over 3 x 3 pixels) - 1/2 (mean over 5 x 5), which is
///            exact for quadratics and evens out quantised depth; the pixel's own depth if the 5 x 5 pixels did not all
///            see the same surface
///   normal   -(a, b, c) / |(a, b, c)| in the camera's axes, of the plane 1 / Z = a x + b y + c that fits the pixels of
///            the same surface in a square window, 2 to 6 pixels to each side, best (least squares). (x, y) are the
///            rays of pixel_rays: 1 / Z of a plane is linear in them, and the noise of a stereo camera the same
///            everywhere in 1 / Z
///   sigma    sqrt((Z^2 s / (f B))^2 + u^2 / 12), s the disparity noise, f the focal length [pixels], B the baseline, u
///            the image's unit of depth
///
/// accuracy   a plane without noise: point and normal exact but for single precision of the depth. A sphere of 8 mm
///            seen by three cameras at 0.35 m: points within 0.006 mm rms, normals 4 degrees rms, more towards the
///            edges where windows are not whole. Noise of 0.36 mm correlated over 5 pixels turns normals by 6 degrees
///            rms
class PointReader {
 public:
  /// throws   InputError as pixel_rays does, if a camera is no pinhole, or if an option is out of its range
  explicit PointReader(std::vector<DepthCamera> cameras, const PointOptions& options = {});

  /// within   points outside are left out: the workspace, or what of it a hand is expected in
  /// returns  camera by camera, row by row
  /// throws   InputError as require_frame does
  HandPoints read(const DepthFrame& frame, const Box& within) const;

  const std::vector<DepthCamera>& cameras() const { return cameras_; }

 private:
  struct Pixel {
    int column;
    int row;
  };
  struct Surface {  // through a pixel
    double depth;   // [m]
    Vector3 normal;
  };

  std::vector<Pixel> chosen(std::size_t camera, const DepthImage& image, const Box& within) const;
  Vector3 seen_at(std::size_t camera, Eigen::Index pixel, double depth) const;
  double noise(const DepthCamera& camera, double depth) const;
  bool surface_at(std::size_t camera, const DepthImage& image, Pixel pixel, Surface& surface) const;

  std::vector<DepthCamera> cameras_;
  std::vector<Eigen::Matrix2Xd> rays_;  // of each camera's pixels
  PointOptions options_;
  double steepest_slope_;
};

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
