#include "sim/body/body.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/rotation.h"

namespace touchfield {

namespace {

/// Barycentric weights of the point of segment a, b that is nearest to x.
std::pair<double, double> nearest_on_side(const Vector3& a, const Vector3& b, const Vector3& x) {
  const double t = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return {1.0 - t, t};
}

/// Barycentric weights of the point of face f that is nearest to x.
Vector3 nearest_on_face(const TriangleMesh& mesh, Eigen::Index f, const Vector3& x) {
  const Vector3 normal = mesh.normals().col(f);
  const double area = mesh.areas()(f);
  Vector3 inside;
  for (int c = 0; c < 3; ++c) {
    const Vector3 b = mesh.corner(f, (c + 1) % 3);
    inside(c) = (mesh.corner(f, (c + 2) % 3) - b).dot(normal.cross(b - x)) / (2.0 * area);
  }
  if (inside.minCoeff() >= 0) {
    return inside / inside.sum();
  }
  Vector3 best = Vector3::Zero();
  double nearest = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c) {
    const int d = (c + 1) % 3;
    const auto [at_c, at_d] = nearest_on_side(mesh.corner(f, c), mesh.corner(f, d), x);
    const double distance = (at_c * mesh.corner(f, c) + at_d * mesh.corner(f, d) - x).squaredNorm();
    if (distance < nearest) {
      nearest = distance;
      best.setZero();
      best(c) = at_c;
      best(d) = at_d;
    }
  }
  return best;
}

Vector3 point_on_face(const TriangleMesh& mesh, Eigen::Index f, const Vector3& barycentric) {
  return barycentric(0) * mesh.corner(f, 0) + barycentric(1) * mesh.corner(f, 1) + barycentric(2) * mesh.corner(f, 2);
}

}  // namespace

Vector3 position(const TriangleMesh& mesh, const Landmark& landmark) {
  return point_on_face(mesh, landmark.face, landmark.barycentric);
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
  if (!point.allFinite()) {
    throw InputError(fmt::format("landmark '{}': its position must be finite numbers", name));
  }
  Landmark best{name, 0, Vector3::Zero()};
  double nearest = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 barycentric = nearest_on_face(mesh, f, point);
    const double distance = (point_on_face(mesh, f, barycentric) - point).squaredNorm();
    if (distance < nearest) {
      nearest = distance;
      best.face = f;
      best.barycentric = barycentric;
    }
  }
  return best;
}

Body placed(const Body& body, const Vector3& anchor, const Vector3& at, const Vector3& angles) {
  const Eigen::Matrix3d rotation = extrinsic_rotation(angles);
  return {transformed(body.mesh, rotation, at - rotation * anchor), body.landmarks};
}

}  // namespace touchfield
