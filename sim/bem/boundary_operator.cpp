#include "sim/bem/boundary_operator.h"

#include <numbers>
#include <stdexcept>

namespace touchfield {

Eigen::VectorXd gauss_diagonal(const TriangleMesh& mesh) {
  const FaceArrays<double> faces(mesh);
  const auto count = static_cast<int>(faces.size());
  Eigen::VectorXd diagonal(count);
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < count; ++i) {
    const double sum = pair_loops().static_sum(faces.point(i), faces.sources(), faces.area.data(), count);
    diagonal(i) = 1.0 + sum / (4.0 * std::numbers::pi);
  }
  return diagonal;
}

Eigen::VectorXd gauss_diagonal(const FaceSums& at_rest) {
  return 1.0 + at_rest.apply(Layer::kDouble, Eigen::MatrixXcd::Ones(at_rest.size(), 1)).real().array();
}

namespace {

void require_diagonal(const BoundaryParts& parts, Eigen::Index size) {
  if (parts.diagonal.size() != size) {
    throw std::invalid_argument("BoundaryOperator: the diagonal must have one value a face");
  }
}

Eigen::MatrixXcd product(const FaceSums& sums, const BoundaryParts& parts, const Eigen::MatrixXcd& x) {
  Eigen::MatrixXcd y = -sums.apply(parts.layer, x);
  if (parts.near) {
    parts.near->add_product(-1.0, x, y);
  }
  y += parts.diagonal.asDiagonal() * x;
  return y;
}

Eigen::MatrixXcd transposed_product(const FaceSums& sums, const BoundaryParts& parts, const Eigen::MatrixXcd& x) {
  Eigen::MatrixXcd y = -sums.apply_transpose(parts.layer, x);
  if (parts.near) {
    parts.near->add_transposed_product(-1.0, x, y);
  }
  y += parts.diagonal.asDiagonal() * x;
  return y;
}

}  // namespace

SummedOperator::SummedOperator(std::shared_ptr<const FaceSums> sums, BoundaryParts parts)
    : sums_(std::move(sums)), parts_(std::move(parts)) {
  require_diagonal(parts_, size());
}

Eigen::MatrixXcd SummedOperator::apply(const Eigen::MatrixXcd& x) const { return product(*sums_, parts_, x); }

Eigen::MatrixXcd SummedOperator::apply_transpose(const Eigen::MatrixXcd& x) const {
  return transposed_product(*sums_, parts_, x);
}

template <typename Real>
BoundaryOperator<Real>::BoundaryOperator(const TriangleMesh& mesh, const Complex& wavenumber, BoundaryParts parts)
    : sum_(mesh, wavenumber, parts.gamma), parts_(std::move(parts)) {
  require_diagonal(parts_, size());
}

template <typename Real>
Eigen::MatrixXcd BoundaryOperator<Real>::apply(const Eigen::MatrixXcd& x) const {
  return product(sum_, parts_, x);
}

template <typename Real>
Eigen::MatrixXcd BoundaryOperator<Real>::apply_transpose(const Eigen::MatrixXcd& x) const {
  return transposed_product(sum_, parts_, x);
}

template <typename Real>
typename BoundaryOperator<Real>::Matrix BoundaryOperator<Real>::dense() const {
  Matrix matrix(size(), size());
  fill_dense(matrix);
  return matrix;
}

template <typename Real>
void BoundaryOperator<Real>::fill_dense(Matrix& matrix) const {
#pragma omp parallel
  {
    Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1> column;
#pragma omp for schedule(static)
    for (Eigen::Index j = 0; j < size(); ++j) {
      sum_.column(parts_.layer, j, column);
      matrix.col(j).head(size()) = -column;
    }
  }
  if (parts_.near) {
    parts_.near->template add_to<Real>(-1.0, matrix);
  }
  matrix.diagonal().head(size()) += parts_.diagonal.template cast<std::complex<Real>>();
}

template <typename Real>
Eigen::MatrixXcd BoundaryOperator<Real>::columns(const std::vector<Eigen::Index>& faces) const {
  const auto count = static_cast<Eigen::Index>(faces.size());
  Eigen::MatrixXcd columns(size(), count);
#pragma omp parallel
  {
    Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1> column;
#pragma omp for schedule(static)
    for (Eigen::Index c = 0; c < count; ++c) {
      sum_.column(parts_.layer, faces[static_cast<std::size_t>(c)], column);
      columns.col(c) = -column.template cast<Complex>();
    }
  }
  if (parts_.near) {
    parts_.near->add_columns(-1.0, faces, columns);
  }
  for (Eigen::Index c = 0; c < count; ++c) {
    const Eigen::Index f = faces[static_cast<std::size_t>(c)];
    columns(f, c) += parts_.diagonal(f);
  }
  return columns;
}

template class BoundaryOperator<float>;
template class BoundaryOperator<double>;

Eigen::MatrixXcd ChiefOperator::apply(const Eigen::MatrixXcd& x) const {
  const Eigen::Index m = b_->size();
  Eigen::MatrixXcd y(size(), x.cols());
  y.topRows(m) = b_->apply(x.topRows(m)) + rows_.adjoint() * x.bottomRows(rows_.rows());
  y.bottomRows(rows_.rows()) = rows_ * x.topRows(m);
  return y;
}

Eigen::MatrixXcd ChiefOperator::apply_transpose(const Eigen::MatrixXcd& x) const {
  const Eigen::Index m = b_->size();
  Eigen::MatrixXcd y(size(), x.cols());
  y.topRows(m) = b_->apply_transpose(x.topRows(m)) + rows_.transpose() * x.bottomRows(rows_.rows());
  y.bottomRows(rows_.rows()) = rows_.conjugate() * x.topRows(m);
  return y;
}

}  // namespace touchfield
