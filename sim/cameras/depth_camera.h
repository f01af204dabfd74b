#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/types.h"
#include "sim/mesh/raster/raster.h"

namespace touchfield {

/// The largest number of a depth image, of 16 bits.
inline constexpr double kMostUnits = 65535;

/// A depth camera as whoever reads its images knows it: intrinsics, distortion, place, unit.
struct DepthCamera {
  std::string name;
  Camera view;                         // pinhole, what its image would be without distortion
  std::array<double, 5> distortion{};  // k1, k2, p1, p2, k3 of Brown and Conrady, in OpenCV's order
  double depth_unit = 1e-3;            // of the numbers in its images [m]
};

/// One depth image, row by row from the upper left pixel.
struct DepthImage {
  int width = 0;             // [pixels]
  int height = 0;            // [pixels]
  std::vector<float> depth;  // Z along the camera's axis [m]; 0 where it saw nothing
};

/// What all cameras saw at one time, one image per camera in their order.
struct DepthFrame {
  double seconds = 0;
  std::vector<DepthImage> images;
};

/// Where the camera's lens puts what a pinhole sees at x = (X / Z, Y / Z).
Eigen::Vector2d distorted(const DepthCamera& camera, const Eigen::Vector2d& x);

struct ImagePoint {
  Eigen::Vector2d at;   // column and row, the middle of the upper left pixel at (0.5, 0.5)
  Eigen::Vector2d ray;  // (X / Z, Y / Z) in the camera's axes
  double depth;         // Z [m]

  /// Where the depth of its pixel stands in an image `width` pixels wide.
  std::size_t pixel(int width) const {
    return static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(width) + static_cast<std::size_t>(at.x());
  }
};

/// Where a point of the world [m] lies in a camera's image. Nothing if the point is nearer than `near` or beside the
/// image. Beyond the image for which it was made, a distortion may fold a point back into the image. Such a point
/// counts as beside the image.
std::optional<ImagePoint> image_point(const DepthCamera& camera, const Vector3& x);

/// Which way each pixel's middle looks: (X / Z, Y / Z) in the camera's axes, 2 x (width height), so that what it sees
/// at depth Z is eye + Z axes (X / Z, Y / Z, 1). With distortion x -> x (1 + k1 r^2 + k2 r^4 + k3 r^6) + tangential
/// part, undone to 1e-9.
///
/// throws   InputError where that cannot be undone within the image
Eigen::Matrix2Xd pixel_rays(const DepthCamera& camera);

/// Writes depths as a PNG file of one channel of 16 bits, atomically: round(depth / unit) of each pixel, 0 where the
/// camera saw nothing. A depth for which there is no such number, below half a unit or above 65535.5, is written as 0,
/// as by a depth camera beyond its range.
///
/// unit     of the numbers [m], > 0
/// source   ISO/IEC 15948
/// throws   InputError on a depth that is negative or not finite; NoRoomError and IoError of write_atomically
void write_depth_png(const std::string& path, const DepthImage& image, double unit);

/// Depths of such a file, number times unit: what was written, to half a unit. What follows the image's end is ignored,
/// and so are its colour space and texts, unless these unpack to more than 64 MiB.
///
/// width, height   that it must have [pixels]; no more memory is taken than an image of this size and such texts need,
///                 whatever the file promises
/// throws          InputError "path: ..." unless it is a whole, undamaged 16-bit grey PNG, not interlaced, of this size
DepthImage read_depth_png(const std::string& path, double unit, int width, int height);

/// The same refusals as far as they can be told without unpacking the image: no such file, another format or size, cut
/// off.
void check_depth_png(const std::string& path, int width, int height);

/// Warnings about a recording that can be read but is probably wrong, one or two sentences each. Cameras: two within 1
/// mm of each other, or all within 3 mm of the world's origin (metres for millimetres). Intrinsics: an axis far from
/// the middle of the image, or pixels that are not square (those of another image). Times: images more than 0.5 s or
/// less than 1 ms apart (not in seconds).
///
/// seconds   of the frames, rising
std::vector<std::string> recording_warnings(const std::vector<DepthCamera>& cameras,
                                            const std::vector<double>& seconds);

}  // namespace touchfield
