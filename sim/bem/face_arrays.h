#pragma once

#include "sim/bem/pair_loops.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A mesh's faces as one array a quantity, for loops that become SIMD code.
struct FaceArrays {
  explicit FaceArrays(const TriangleMesh& mesh);

  Eigen::VectorXd x, y, z;     // centroids [m]
  Eigen::VectorXd nx, ny, nz;  // unit normals
  Eigen::VectorXd area;        // [m2]

  Eigen::Index size() const { return area.size(); }
  PairPoint<double> point(Eigen::Index i) const { return {x(i), y(i), z(i), nx(i), ny(i), nz(i)}; }
  PairSources<double> sources() const { return {x.data(), y.data(), z.data(), nx.data(), ny.data(), nz.data()}; }
};

/// One point for each face: A_j dg/dn_j (point, x_j) for the faces first .. first + count - 1.
///
/// re, im   count values each; not finite where the point is that face's centroid
void double_layer_weights(const FaceArrays& faces, const Vector3& point, const Complex& wavenumber, Eigen::Index first,
                          Eigen::Index count, double* re, double* im);

}  // namespace touchfield
