#pragma once

#include <memory>

#include "sim/bem/layer_sum.h"
#include "sim/bem/near_corrections.h"
#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// What a boundary operator is made of: B = diagonal - K, K the sum of one layer with one point a face plus what near
/// faces lack of it.
struct BoundaryParts {
  Layer layer = Layer::kDouble;                 // kDouble or kBurtonMiller
  double gamma = 0;                             // eta = i gamma [m]
  Eigen::VectorXcd diagonal;                    // M
  std::shared_ptr<const NearCorrections> near;  // of the same layer; none: one point everywhere
};

/// B without storing it: every product computes its entries anew. Real is the precision of the sums with one point a
/// face; near corrections are kept in double by all that share them.
template <typename Real>
class BoundaryOperator : public LinearOperator {
 public:
  BoundaryOperator(const TriangleMesh& mesh, const Complex& wavenumber, BoundaryParts parts);

  Eigen::Index size() const override { return sum_.size(); }
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

  /// The given columns of the same matrix, M x K.
  Eigen::MatrixXcd columns(const std::vector<Eigen::Index>& faces) const;

  using Matrix = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;
  /// The same matrix stored, M x M.
  Matrix dense() const;
  /// The same into the first M rows and columns of a larger one.
  void fill_dense(Matrix& matrix) const;

 private:
  LayerSum<Real> sum_;
  BoundaryParts parts_;
};

extern template class BoundaryOperator<float>;
extern template class BoundaryOperator<double>;

}  // namespace touchfield
