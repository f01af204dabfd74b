#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "sim/bem/layer_sum.h"
#include "sim/bem/quadrature.h"
#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// The part that a sum with one point per face leaves out, by rows. For each pair of faces nearer than the rule's reach
/// it is the integral over the face minus its one-point value.
///
/// memory   20 bytes per pair, 12 in single precision; some 220 pairs per face with FaceRule's distances, 240 on a
///          whole hand
class NearCorrections {
 public:
  enum class Numbers { kDouble, kSingle };  // that are kept; they are made in double

  NearCorrections(const TriangleMesh& mesh, const Complex& wavenumber, double gamma, Layer layer, const FaceRule& rule,
                  Numbers numbers = Numbers::kDouble);

  Eigen::Index size() const { return static_cast<Eigen::Index>(start_.size()) - 1; }
  std::size_t pairs() const { return columns_.size(); }

  /// y += factor N x
  void add_product(const Complex& factor, const Eigen::MatrixXcd& x, Eigen::MatrixXcd& y) const;
  /// y += factor N^T x
  void add_transposed_product(const Complex& factor, const Eigen::MatrixXcd& x, Eigen::MatrixXcd& y) const;
  /// matrix += factor N
  template <typename Real>
  void add_to(const Complex& factor, Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& matrix) const;
  /// row += factor times a row of N, in single precision, of the columns that have a place in the row (-1: none)
  void add_row(double factor, Eigen::Index face, const std::vector<std::int32_t>& places, Eigen::VectorXcf& row) const;
  /// columns += factor times the given columns of N; one column of `columns` for each face, in their order
  void add_columns(const Complex& factor, const std::vector<Eigen::Index>& faces, Eigen::MatrixXcd& columns) const;

 private:
  /// work(the values that are kept)
  template <typename Work>
  void with_values(const Work& work) const {
    singles_.empty() ? work(values_) : work(singles_);
  }

  std::vector<std::size_t> start_;  // M + 1
  std::vector<std::int32_t> columns_;
  std::vector<Complex> values_;  // one of these two
  std::vector<std::complex<float>> singles_;
};

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

 protected:
  const BoundaryParts& parts() const { return parts_; }

 private:
  std::shared_ptr<const FaceSums> sums_;
  BoundaryParts parts_;
};

/// B without storing it: every product computes its entries again. Real is the precision of the sums with one point per
/// face; near corrections are kept in double by all that share them.
template <typename Real>
class BoundaryOperator : public SummedOperator {
 public:
  BoundaryOperator(const TriangleMesh& mesh, const Complex& wavenumber, const BoundaryParts& parts)
      : BoundaryOperator(std::make_shared<const LayerSum<Real>>(mesh, wavenumber, parts.gamma), parts) {}

  /// The given columns of the same matrix, M x K.
  Eigen::MatrixXcd columns(const std::vector<Eigen::Index>& faces) const;

  using Matrix = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;
  /// The same matrix stored, M x M.
  Matrix dense() const;
  /// The same into the first M rows and columns of a larger one.
  void fill_dense(Matrix& matrix) const;

 private:
  BoundaryOperator(const std::shared_ptr<const LayerSum<Real>>& sum, const BoundaryParts& parts)
      : SummedOperator(sum, parts), sum_(*sum) {}

  const LayerSum<Real>& sum_;
};

extern template class BoundaryOperator<float>;
extern template class BoundaryOperator<double>;

/// B + C^H C of CHIEF: the rows C ask the total field to vanish at points inside the body.
class ChiefOperator : public LinearOperator {
 public:
  /// b      B, M x M
  /// rows   C, Z x M
  ChiefOperator(std::unique_ptr<LinearOperator> b, Eigen::MatrixXcd rows) : b_(std::move(b)), rows_(std::move(rows)) {}

  Eigen::Index size() const override { return b_->size(); }
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

 private:
  std::unique_ptr<LinearOperator> b_;
  Eigen::MatrixXcd rows_;
};

inline constexpr int kPolishingSteps = 2;  // a third lets what resonates grow back

/// B_c of paper_corrected, by whose products burton_miller_polished polishes: p += e - B_c p.
///
/// diagonal   gauss_diagonal()
inline BoundaryParts polishing_parts(Eigen::VectorXcd diagonal) {
  return {Layer::kDouble, 0.0, std::move(diagonal), nullptr};
}

}  // namespace touchfield
