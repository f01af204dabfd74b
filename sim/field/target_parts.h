#pragma once

#include <vector>

#include "sim/field/target_box.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The part of a face that one box holds: a convex polygon.
struct FacePart {
  Eigen::Index face;
  int box;                             // the first that holds it
  std::vector<Vector3> corners;        // counter-clockwise, seen from the side that the face's normal points to [m]
  std::vector<unsigned char> borders;  // 1 where the line from a corner to the next lies on a side of its box
  double area;                         // [m2]
  Vector3 centroid;                    // [m]
};

/// The parts of the faces of a mesh that boxes hold, face by face. Each face is cut along the sides of the boxes. A
/// cylinder is a prism of 64 sides with the same section. A mask holds faces as a whole, by their centroids.
///
/// accuracy   exact but for rounding; a part below kLeastPart of its face is left out
std::vector<FacePart> face_parts(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes);

inline constexpr double kLeastPart = 1e-3;

}  // namespace touchfield
