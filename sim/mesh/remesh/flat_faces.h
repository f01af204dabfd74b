#pragma once

#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What remove_flat_faces() did.
struct FlatFaces {
  Eigen::Index removed = 0;
  Vector3 first = Vector3::Zero();  // a corner of the first [m]
};

/// Removes faces with next to no area. The shortest edge of a needle is at most a thousandth of its longest, and is
/// collapsed. Other faces are removed by a flip of their longest edge, where that leaves two faces with area. So are
/// needles that cannot be collapsed. Faces that neither removes stay.
///
/// points   of the mesh's vertices
/// least    area over the longest edge squared; a face below is flat
FlatFaces remove_flat_faces(EditMesh& mesh, const Points& points, double least);

}  // namespace touchfield
