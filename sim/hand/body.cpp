#include "sim/hand/body.h"

#include <algorithm>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/rigid_motion.h"
#include "sim/mesh/face_shape.h"

namespace touchfield {

Vector3 position(const TriangleMesh& mesh, const Landmark& landmark) {
  const Vector3& weights = landmark.barycentric;
  return weights(0) * mesh.corner(landmark.face, 0) + weights(1) * mesh.corner(landmark.face, 1) +
         weights(2) * mesh.corner(landmark.face, 2);
}

const Landmark& find_landmark(const Body& body, const std::string& name) {
  const auto found =
      std::find_if(body.landmarks.begin(), body.landmarks.end(), [&](const Landmark& l) { return l.name == name; });
  if (found != body.landmarks.end()) {
    return *found;
  }
  std::string known;
  for (const Landmark& landmark : body.landmarks) {
    known += (known.empty() ? "" : ", ") + landmark.name;
  }
  throw InputError(fmt::format("landmark '{}' is not on this body; it has {}", name, known.empty() ? "none" : known));
}

Landmark nearest_landmark(const TriangleMesh& mesh, const std::string& name, const Vector3& point) {
  require(point.allFinite(), "landmark '{}': its position must be finite numbers", name);
  Eigen::Index face = 0;
  Vector3 at = Vector3::Zero();
  double nearest = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 on_face = nearest_on_triangle(mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2), point);
    if (const double squared = (on_face - point).squaredNorm(); squared < nearest) {
      nearest = squared;
      face = f;
      at = on_face;
    }
  }
  return {name, face, barycentric(mesh, face, at)};
}

Body placed(const Body& body, const Vector3& anchor, const Vector3& at, const Vector3& angles) {
  const Eigen::Matrix3d rotation = extrinsic_rotation(angles);
  return {transformed(body.mesh, rotation, at - rotation * anchor), body.landmarks};
}

}  // namespace touchfield
