#include "sim/tracking/seen_distance.h"

#include <cmath>
#include <limits>

#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kSteepest = 75 * kDegree;

}  // namespace

SeenDistance seen_distance(const std::vector<DepthCamera>& cameras, const DepthFrame& frame, const TriangleMesh& mesh,
                           double reach) {
  SeenDistance seen{Eigen::VectorXd::Zero(mesh.face_count()), Eigen::VectorXi::Zero(mesh.face_count())};
  const double least_cosine = std::cos(kSteepest);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera& view = cameras[c].view;
    const DepthImage& image = frame.images[c];
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 from_eye = mesh.centroids().col(f) - view.eye;
      const Vector3 x = view.axes.transpose() * from_eye;
      if (!(x.z() > view.near) || -mesh.normals().col(f).dot(from_eye) < least_cosine * from_eye.norm()) {
        continue;
      }
      const Eigen::Vector2d ray = x.head<2>() / x.z();
      const Eigen::Vector2d pixel = distorted(cameras[c], ray).cwiseProduct(view.focal) + view.centre;
      if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < image.width && pixel.y() < image.height)) {
        continue;
      }
      const Eigen::Vector2d middle = pixel.array().floor() + 0.5;
      const auto depth =
          static_cast<double>(image.depth[static_cast<std::size_t>(pixel.y()) * static_cast<std::size_t>(image.width) +
                                          static_cast<std::size_t>(pixel.x())]);
      if (depth > 0 && std::abs(depth - x.z()) <= reach) {
        // Lenses bend little within a pixel.
        const Eigen::Vector2d seen_ray = ray + (middle - pixel).cwiseQuotient(view.focal);
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
