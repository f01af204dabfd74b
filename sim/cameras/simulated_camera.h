#pragma once

#include <cstdint>
#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/cameras/stereo_noise.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/scene/motion_spec.h"

namespace touchfield {

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
