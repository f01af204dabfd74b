#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Pressures on a surface by their values at a few of its faces. Distances are in (x, 0.35 wavelength n), n the normal:
/// the two sides of a fold are far from each other. Every face has a point within 0.33 wavelengths; each face
/// interpolates from its 8 nearest points with the weights C^-1 c of the covariance 2 J1(k r) / (k r), 1e-3
/// added on the diagonal. The number of points follows from the area per square wavelength, not from the mesh.
class CoarseSpace {
 public:
  /// k   [1/m]
  CoarseSpace(const TriangleMesh& mesh, double k);

  Eigen::Index faces() const { return interpolation_.rows(); }
  Eigen::Index size() const { return interpolation_.cols(); }
  const std::vector<Eigen::Index>& points() const { return points_; }  // faces, ascending
  const Eigen::MatrixXd& places() const { return places_; }            // of the points, 6 x size [m]
  using Interpolation = Eigen::SparseMatrix<float, Eigen::RowMajor>;
  const Interpolation& interpolation() const { return interpolation_; }  // P, faces x size

  /// P c.
  Eigen::MatrixXcd interpolated(const Eigen::MatrixXcd& c) const;
  /// P^T v.
  Eigen::MatrixXcd gathered(const Eigen::MatrixXcd& v) const;
  /// R v = (P^T A P)^-1 P^T A v, the projection by areas A.
  Eigen::MatrixXcd projected(const Eigen::MatrixXcd& v) const;
  /// R^T c.
  Eigen::MatrixXcd projected_transpose(const Eigen::MatrixXcd& c) const;

 private:
  Eigen::MatrixXcd by_mass(const Eigen::MatrixXcd& c) const;  // (P^T A P)^-1 c

  std::vector<Eigen::Index> points_;
  Eigen::MatrixXd places_;
  Interpolation interpolation_;
  Interpolation gathering_;  // P^T
  Eigen::VectorXd areas_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> mass_;
};

}  // namespace touchfield
