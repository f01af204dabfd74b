#pragma once

#include <cstdint>
#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/mesh/raster/raster.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/scene/motion_spec.h"

namespace touchfield {

/// A stereo depth camera as it is. Its image is of its first eye; the second stands to the right of that one.
struct StereoCamera {
  Camera view;                  // of the first eye, a pinhole
  double baseline = 0;          // B, between the eyes [m]
  double widest_disparity = 0;  // that it searches [pixels]
  double disparity_noise = 0;   // s, root mean square [pixels]
  double depth_unit = 1e-3;     // of the numbers in its images, 16 bits each [m]

  /// Disparity times depth: f B [pixels m], f the focal length along the rows.
  double disparity_metres() const { return view.focal.x() * baseline; }
  /// The least depth that it finds [m].
  double nearest() const { return disparity_metres() / widest_disparity; }
};

/// What makes the image of a stereo camera worse than the exact one; each can be left out.
struct StereoEffects {
  bool noise = true;            // of the disparity
  bool disparity_steps = true;  // to kDisparityStep
  bool depth_steps = true;      // to the camera's unit; nothing beyond 65535 of it
  bool grazing = true;          // holes where the skin is seen at more than kGrazing
  bool second_eye = true;       // holes where the second eye does not see it: hidden, or beside its image
  bool range = true;            // holes nearer than the camera's nearest depth
  bool flying = true;           // pixels of an edge between front and back

  static StereoEffects none() { return {false, false, false, false, false, false, false}; }
};

/// Standard deviation of the Gaussian weights that make white noise correlated [pixels]. The correlation of pixels r
/// apart is exp(-r^2 / (4 kNoiseBlur^2)). It is 1/e at 5 pixels, about what a stereo matcher's window gives.
inline constexpr double kNoiseBlur = 2.5;
inline constexpr double kDisparityStep = 1.0 / 32;     // [pixels]
inline constexpr double kGrazing = 1.308996938995747;  // 75 degrees, between the ray and the face's normal [rad]
/// Share of the pixels at an edge that fly. A pixel is at an edge if its neighbour to the left, right, above or below
/// sees nothing or has a disparity less by kEdgeJump. The depth of a pixel that flies is uniform between the front and
/// the back. It is at most kLongestFlight behind the front.
inline constexpr double kFlyingShare = 0.2;
inline constexpr double kEdgeJump = 1.0;  // [pixels]; skin that is not grazing changes by less from pixel to pixel
inline constexpr double kLongestFlight = 50e-3;  // [m]

/// The part of an image that sees anything.
struct SeenPart {
  int left = 0;
  int top = 0;
  int right = 0;   // one beyond
  int bottom = 0;  // one beyond

  int width() const { return right - left; }
  int height() const { return bottom - top; }
};
SeenPart seen_part(const Raster& raster);

/// The start of a camera's random numbers. It follows from the seed, the camera's number and the frame's number. An
/// image thus depends on no other image, no order and no number of threads.
std::uint64_t noise_key(std::uint64_t seed, std::uint64_t camera, std::uint64_t frame);

/// The image of a stereo camera, from the raster of its first eye:
///
///   d = f B / z + s n,   z' = f B / round(d, 1/32 pixel), rounded to the unit
///
/// n is Gaussian noise of unit variance with the correlation above. It is made of uniform numbers under Gaussian
/// weights; its excess kurtosis is -0.03. For small s the noise of the depth is z^2 s / (f B). The noise is drawn for
/// the part of the image that sees anything, with the values that the whole image would have there.
/// The column of a point in the second eye's image is u - d. The second eye does not see a point if one to its right in
/// the row has no larger u - d. It is thus assumed that the first eye also sees the points that hide others from the
/// second.
///
/// raster    of camera.view and a mesh
/// normals   of the mesh's faces, world frame
/// key       noise_key
/// returns   depth [m]; 0 where there is none
DepthImage stereo_image(const StereoCamera& camera, const Raster& raster, const Points& normals,
                        const StereoEffects& effects, std::uint64_t key);

/// The camera that a scene asks for, where it really stands.
///
/// Its pixels are square. An image of 16 : 9 has the model's field of view across: f = width / (2 tan(across / 2)). For
/// the D415 at 640 x 360 this gives f = 502.3 pixels, and 39.4 degrees down. A narrower image has the same field of
/// view down, as the real camera then leaves out columns. A wider image has the same field of view across. The axis is
/// seen in the middle of the image. There is no distortion, as such cameras rectify their images. With roll 0 the
/// camera's right is level. If the camera looks straight up or down, its right is then the world's +x. The roll turns
/// the camera clockwise about its axis, as seen from behind.
StereoCamera stereo_camera(const CameraSpec& spec);

/// What a camera would see of a mesh if it were exact: the depth of the nearest face in the middle of each pixel.
DepthImage exact_image(const Camera& camera, const TriangleMesh& mesh);

/// Depth cameras that are simulated: how they stand, how whoever reads their images is told that they stand, what they
/// see.
class SimulatedCameras {
 public:
  /// seed     of the errors of their places and of their noise; each camera has its own by its number
  /// throws   InputError on an unknown model
  SimulatedCameras(const std::vector<CameraSpec>& specs, std::uint64_t seed);

  const std::vector<StereoCamera>& real() const { return real_; }

  /// The same cameras, called camera_1 and so on, each shifted by the spec's shift_error and turned by its turn_error
  /// about its eye. Direction and axis are uniform on the sphere, in the camera's own axes.
  const std::vector<DepthCamera>& told() const { return told_; }

  /// The images of all cameras at one time.
  ///
  /// mesh     what there is, in the world's frame: whole, since it hides itself
  /// frame    its number: another one has other noise
  DepthFrame sees(const TriangleMesh& mesh, double seconds, std::uint64_t frame,
                  const StereoEffects& effects = {}) const;

 private:
  std::vector<StereoCamera> real_;
  std::vector<DepthCamera> told_;
  std::uint64_t seed_;
};

}  // namespace touchfield
