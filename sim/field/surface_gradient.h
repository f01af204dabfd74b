#pragma once

#include <vector>

#include <Eigen/SparseCore>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Gradient along the skin of a sound pressure that is known at the faces' centroids.
///
/// On each face f the gradient is the best linear estimate from the pressures of nearby faces. These are the faces that
/// share a vertex with f, and those that share one with these. The pressure is taken for a random isotropic sound field
/// of wavenumber k and unknown mean. Its covariance at two points r apart is sin(kr)/(kr). With
/// gamma(r) = 1 - sin(kr)/(kr),
///
///   grad_t p (x_f) = sum_i w_i (p_i - p_f),   K w = g,
///   K_ij = gamma(r_if) + gamma(r_jf) - gamma(r_ij) + e (delta_ij + 1),   g_i = gamma'(r_if) (x_i - x_f)_t / r_if
///
/// (kriging), t the part in the plane of the face. e = 1e-4 min(1, (kR/3)^4) is the assumed mean square error of
/// pressures, of their mean square, R the distance of the farthest neighbour. No sound varies faster than such a field.
/// So few samples per wavelength suffice where polynomials smooth.
///
/// Of more than 40 neighbours the 40 nearest count. Faces with normals more than 60 degrees off do not count. Along a
/// direction that the neighbours leave open the slope is 0, and so is the gradient of a face without neighbours.
/// Weights are kept in single precision.
///
/// accuracy   docs/accuracy.md, "Forces"; exact where the pressure is uniform
/// source     Cressie, Statistics for Spatial Data, ch. 3 (ordinary kriging); Cook et al. 1955, the covariance
class SurfaceGradient {
 public:
  /// k   [rad/m], > 0
  SurfaceGradient(const TriangleMesh& mesh, double k);

  /// pressure   M
  /// returns    3 x M, tangential [1/m of its unit]
  Eigen::Matrix3Xcd of(const Eigen::VectorXcd& pressure) const;

 private:
  Points u_;  // two directions in each face's plane, at right angles
  Points v_;
  Eigen::SparseMatrix<float, Eigen::RowMajor> slopes_;  // of all faces
};

/// The same gradient of some faces as a matrix: rows 2i and 2i + 1 are the slopes at faces[i] along two directions in
/// its plane, at right angles [1/m].
///
/// faces     K
/// returns   2 K x M
Eigen::SparseMatrix<float, Eigen::RowMajor> surface_slopes(const TriangleMesh& mesh, double k,
                                                           const std::vector<Eigen::Index>& faces);

}  // namespace touchfield
