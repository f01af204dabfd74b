#include "sim/cameras/seen_distance.h"

#include <cmath>
#include <limits>

#include "sim/cameras/hand_points.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kSteepest = 75 * kDegree;

}  // namespace

SeenDistance seen_distance(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const TriangleMesh& mesh,
                           double reach) {
  require_frame(cameras, frame);
  SeenDistance seen{Eigen::VectorXd::Zero(mesh.face_count()), Eigen::VectorXi::Zero(mesh.face_count())};
  const double least_cosine = std::cos(kSteepest);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& view = cameras[c].view;
    const DepthImage& image = frame.images[c];
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 from_eye = mesh.centroids().col(f) - view.eye;
      if (-mesh.normals().col(f).dot(from_eye) < least_cosine * from_eye.norm()) {
        continue;
      }
      const std::optional<ImagePoint> centroid = image_point(cameras[c], mesh.centroids().col(f));
      if (!centroid) {
        continue;
      }
      const Eigen::Vector2d middle = centroid->at.array().floor() + 0.5;
      const auto depth = static_cast<double>(image.depth[centroid->pixel(image.width)]);
      if (depth > 0 && std::abs(depth - centroid->depth) <= reach) {
        // Lenses bend little within a pixel.
        const Eigen::Vector2d seen_ray = centroid->ray + (middle - centroid->at).cwiseQuotient(view.focal);
        const Vector3 point = view.axes * (depth * seen_ray.homogeneous());
        seen.distance(f) += mesh.normals().col(f).dot(point - from_eye);
        ++seen.cameras(f);
      }
    }
  }
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    seen.distance(f) =
        seen.cameras(f) > 0 ? seen.distance(f) / seen.cameras(f) : std::numeric_limits<double>::quiet_NaN();
  }
  return seen;
}

}  // namespace touchfield
