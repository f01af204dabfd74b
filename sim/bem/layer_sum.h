#pragma once

#include "sim/bem/face_arrays.h"
#include "sim/bem/face_sums.h"
#include "sim/bem/pair_loops.h"
#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// FaceSums pair by pair, computed again each time: nothing is stored but the points.
///
/// Real       precision of the kernels; sums run over 256 faces in it and further in double
/// accuracy   of the sum, relative: 1e-6 in float, 1e-14 in double, for bodies up to 100 wavelengths across
template <typename Real>
class LayerSum : public FaceSums {
 public:
  /// wavenumber   k + i alpha [1/m]
  /// gamma        eta = i gamma [m]; of the layers that have it
  LayerSum(const TriangleMesh& mesh, const Complex& wavenumber, double gamma);

  Eigen::Index size() const override { return faces_.size(); }

  Eigen::MatrixXcd apply(Layer layer, const Eigen::MatrixXcd& x) const override;

  /// The first `rows` values of apply, row by row: the reference for apply, which takes both directions of a pair at
  /// once where it can.
  Eigen::MatrixXcd apply_head(Layer layer, const Eigen::MatrixXcd& x, Eigen::Index rows) const;

  Eigen::MatrixXcd apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const override;

  /// Column j of kDouble or kBurtonMiller, A_j K(x_i, x_j) for all i; 0 at i = j.
  void column(Layer layer, Eigen::Index j, Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1>& values) const;

  /// A_j K(z, x_j) for points that are no centroids [m], with kDouble or kSingle: J x M.
  Eigen::MatrixXcd rows(Layer layer, const Points& points) const;

 private:
  void fill(Layer layer, const PairPoint<Real>& at, Eigen::Index first, Eigen::Index count, Real* re, Real* im) const;
  Eigen::MatrixXcd sums_by_rows(Layer layer, const Eigen::MatrixXcd& weighted, Eigen::Index rows) const;
  Eigen::MatrixXcd sums_by_panels(Layer layer, const Eigen::MatrixXcd& weighted) const;
  Eigen::MatrixXcd sums_by_pairs(Layer layer, bool transposed, const Eigen::MatrixXcd& weighted) const;

  Vector3 origin_;
  double scale_;  // half wavelengths per metre
  PairConstants<Real> constants_;
  FaceArrays<Real> faces_;  // in half wavelengths from the origin
  Eigen::VectorXd weight_;  // A / 4 pi in half wavelengths
};

extern template class LayerSum<float>;
extern template class LayerSum<double>;

}  // namespace touchfield
