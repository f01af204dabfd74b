#pragma once

#include "sim/bem/pair_loops.h"
#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A mesh's faces as one array a quantity, for the loops over pairs.
template <typename Real>
struct FaceArrays {
  /// scale    units of length a metre
  /// origin   of the places [m]
  explicit FaceArrays(const TriangleMesh& mesh, double scale = 1.0, const Vector3& origin = Vector3::Zero());

  using Values = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  Values x, y, z;        // centroids
  Values nx, ny, nz;     // unit normals
  Eigen::VectorXd area;  // in double

  Eigen::Index size() const { return area.size(); }
  PairPoint<Real> point(Eigen::Index i) const { return {x(i), y(i), z(i), nx(i), ny(i), nz(i)}; }

  /// The faces from `first` on.
  PairSources<Real> sources(Eigen::Index first = 0) const {
    return {x.data() + first,  y.data() + first,  z.data() + first,
            nx.data() + first, ny.data() + first, nz.data() + first};
  }
};

/// Half wavelengths per metre, the unit of lengths in the loops over pairs.
double half_wavelengths(const Complex& wavenumber);

/// What the loops need of a wavenumber k + i alpha [1/m] and a coupling gamma [m] in that unit.
template <typename Real>
PairConstants<Real> pair_constants(const Complex& wavenumber, double gamma);

/// Sums over the faces of a body with one point per face,
///
///   y_i = sum over j != i of A_j K(x_i, x_j) x_j,   K one of Layer's kernels, x the centroids,
///
/// pair by pair (LayerSum) or by a grid (grid_sum.h).
class FaceSums {
 public:
  FaceSums() = default;
  FaceSums(const FaceSums&) = delete;
  FaceSums& operator=(const FaceSums&) = delete;
  virtual ~FaceSums() = default;

  virtual Eigen::Index size() const = 0;

  /// M x S to M x S; [m] for the single layer, no unit otherwise.
  virtual Eigen::MatrixXcd apply(Layer layer, const Eigen::MatrixXcd& x) const = 0;

  /// The transpose, without conjugation, of kDouble or kBurtonMiller.
  virtual Eigen::MatrixXcd apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const = 0;
};

/// Which layer is the transpose of another, but for the areas.
/// throws   std::invalid_argument for layers other than kDouble and kBurtonMiller
Layer transposed(Layer layer);

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

  /// Row i of any layer, A_j K(x_i, x_j) for all j; 0 at j = i.
  void row(Layer layer, Eigen::Index i, Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1>& values) const;

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
