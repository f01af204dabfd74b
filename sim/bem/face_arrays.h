#pragma once

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A mesh's faces as one array a quantity, for loops that become SIMD code.
struct FaceArrays {
  explicit FaceArrays(const TriangleMesh& mesh);

  Eigen::VectorXd x, y, z;     // centroids [m]
  Eigen::VectorXd nx, ny, nz;  // unit normals
  Eigen::VectorXd area;        // [m2]

  Eigen::Index size() const { return area.size(); }
};

/// One point for each face: A_j dg/dn_j (point, x_j) for the faces first .. first + count - 1.
///
/// re, im   count values each; not finite where the point is that face's centroid
void double_layer_weights(const FaceArrays& faces, const Vector3& point, const Complex& wavenumber, Eigen::Index first,
                          Eigen::Index count, double* re, double* im);

/// The other way round: A_j dg/dn_j (x_i, x_j) of one face j at all centroids i.
///
/// re, im   size() values each; that of i = j is not finite
void double_layer_column(const FaceArrays& faces, Eigen::Index j, const Complex& wavenumber, double* re, double* im);

}  // namespace touchfield
