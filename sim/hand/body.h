#pragma once

#include <string>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A named point on the skin, kept relative to a face so that it follows a mesh that moves or deforms.
struct Landmark {
  std::string name;
  Eigen::Index face;
  Vector3 barycentric;  // weights of the face's corners, sum 1
};

/// A mesh in its own frame with its landmarks.
struct Body {
  TriangleMesh mesh;
  std::vector<Landmark> landmarks;
};

/// Position of a landmark on a mesh [m].
Vector3 position(const TriangleMesh& mesh, const Landmark& landmark);

/// The landmark of this name.
/// throws   InputError that lists the names there are
const Landmark& find_landmark(const Body& body, const std::string& name);

/// The landmark at the point of the mesh that is nearest to a point [m].
/// throws   InputError if the point is not finite
Landmark nearest_landmark(const TriangleMesh& mesh, const std::string& name, const Vector3& point);

/// The body moved so that `anchor` [m] (in its own frame) lands on `at` [m] after a rotation about the anchor.
///
/// angles   extrinsic, about x, y, z [rad]
Body placed(const Body& body, const Vector3& anchor, const Vector3& at, const Vector3& angles);

}  // namespace touchfield
