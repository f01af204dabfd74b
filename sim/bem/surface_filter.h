#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A polynomial in the Laplacian of a surface. It is about the inverse of Burton and Miller's matrix on waves too
/// short to travel:
///
///   f(L),   f(l) = 2 / (1 + c sqrt(1 - l / k_e^2)),   k_e = k (1 + 0.1 i),
///
/// the inverse of the operator's symbol on a plane, c its coupling. L is the two-point finite-volume Laplacian,
/// (L x)_i = sum over edges of l_ij / (h_i + h_j) (x_i - x_j) / A_i, h the distances of the centroids from the edge.
/// The polynomial is Chebyshev's on [0, largest eigenvalue by Gershgorin], of degree 4 and half the ratio of the
/// shortest wavenumber of the mesh to k, 16 at most.
class SurfaceFilter {
 public:
  /// wavenumber   k + i alpha [1/m]
  /// coupling     c > 0
  SurfaceFilter(const TriangleMesh& mesh, const Complex& wavenumber, double coupling);

  int degree() const { return static_cast<int>(coefficients_.size()) - 1; }

  /// f(L) X, M x S.
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const;
  /// f(L)^T X = A f(L) A^-1 X, A the areas.
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const;

 private:
  Eigen::VectorXd areas_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> shifted_;  // 2 L / largest eigenvalue - 1
  Eigen::VectorXcd coefficients_;
};

}  // namespace touchfield
