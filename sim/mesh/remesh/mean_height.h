#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Of the faces round each vertex.
struct VertexMeans {
  explicit VertexMeans(const TriangleMesh& mesh);

  Points normals;         // 3 x V unit vectors, means by area; 0 where there are no faces
  Eigen::VectorXd areas;  // V [m2], of them all: thrice a vertex' share of the skin
};

/// A mesh whose vertices stand off the surface that it is inscribed in by the mean distance that their faces cut below
/// it, so that area and volume are the surface's to second order in edge over radius of curvature.
///
/// heights   mean height of the surface above each face along its normal [m]
/// most      no vertex is moved farther [m]; 0 for those that stay
TriangleMesh with_mean_height_zero(const TriangleMesh& mesh, const Eigen::VectorXd& heights,
                                   const Eigen::VectorXd& most);

}  // namespace touchfield
