#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Of the faces round each vertex.
struct VertexMeans {
  explicit VertexMeans(const TriangleMesh& mesh);

  Points normals;         // 3 x V unit vectors, means by area; 0 where there are no faces
  Eigen::VectorXd areas;  // V [m2], of them all: thrice a vertex' share of the skin
};

/// A mesh with its vertices moved off the surface that it is inscribed in. Each moves by the mean distance by which its
/// faces cut below the surface. Area and volume are then the surface's to second order in edge over radius of
/// curvature.
///
/// heights   mean height of the surface above each face along its normal [m]
/// most      no vertex is moved farther [m]; 0 for those that stay
TriangleMesh with_mean_height_zero(const TriangleMesh& mesh, const Eigen::VectorXd& heights,
                                   const Eigen::VectorXd& most);

}  // namespace touchfield
