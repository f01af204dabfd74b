#pragma once

#include <memory>
#include <utility>

#include "sim/bem/layer_sum.h"
#include "sim/bem/near_corrections.h"
#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// What a boundary operator is made of: B = diagonal - K, K the sum of one layer with one point per face plus what near
/// faces lack of it.
struct BoundaryParts {
  Layer layer = Layer::kDouble;                 // kDouble or kBurtonMiller
  double gamma = 0;                             // eta = i gamma [m]
  Eigen::VectorXcd diagonal;                    // M
  std::shared_ptr<const NearCorrections> near;  // of the same layer; none: one point everywhere
};

/// The diagonal of scheme `paper_corrected` from the static Gauss identity,
///
///   B_ii = 1 + sum over j != i of A_j n_j.(x_i - x_j) / (4 pi r^3),
///
/// with which a constant pressure is solved exactly at k = 0: near 1/2, more where the surface bends outwards.
Eigen::VectorXd gauss_diagonal(const TriangleMesh& mesh);
/// The same by sums at k = 0.
Eigen::VectorXd gauss_diagonal(const FaceSums& at_rest);

/// B by sums that others may use too.
class SummedOperator : public LinearOperator {
 public:
  SummedOperator(std::shared_ptr<const FaceSums> sums, BoundaryParts parts);

  Eigen::Index size() const override { return sums_->size(); }
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

 private:
  std::shared_ptr<const FaceSums> sums_;
  BoundaryParts parts_;
};

/// B without storing it: every product computes its entries again. Real is the precision of the sums with one point per
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

/// The square form of CHIEF, [[B, C^H], [C, 0]]: the rows C ask the total field to vanish at points inside the body,
/// their multipliers lambda make room for that.
class ChiefOperator : public LinearOperator {
 public:
  /// b      B, M x M
  /// rows   C, Z x M
  ChiefOperator(std::unique_ptr<LinearOperator> b, Eigen::MatrixXcd rows) : b_(std::move(b)), rows_(std::move(rows)) {}

  Eigen::Index size() const override { return b_->size() + rows_.rows(); }
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

 private:
  std::unique_ptr<LinearOperator> b_;
  Eigen::MatrixXcd rows_;
};

}  // namespace touchfield
