#pragma once

#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/core/box_tree.h"
#include "sim/core/units.h"

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

}  // namespace touchfield
