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

template <typename Real>
BoundaryOperator<Real>::BoundaryOperator(const TriangleMesh& mesh, const Complex& wavenumber, BoundaryParts parts)
    : sum_(mesh, wavenumber, parts.gamma), parts_(std::move(parts)) {
  if (parts_.diagonal.size() != sum_.size()) {
    throw std::invalid_argument("BoundaryOperator: the diagonal must have one value a face");
  }
}

template <typename Real>
Eigen::MatrixXcd BoundaryOperator<Real>::apply(const Eigen::MatrixXcd& x) const {
  Eigen::MatrixXcd y = -sum_.apply(parts_.layer, x);
  if (parts_.near) {
    parts_.near->add_product(-1.0, x, y);
  }
  y += parts_.diagonal.asDiagonal() * x;
  return y;
}

template <typename Real>
Eigen::MatrixXcd BoundaryOperator<Real>::apply_transpose(const Eigen::MatrixXcd& x) const {
  Eigen::MatrixXcd y = -sum_.apply_transpose(parts_.layer, x);
  if (parts_.near) {
    parts_.near->add_transposed_product(-1.0, x, y);
  }
  y += parts_.diagonal.asDiagonal() * x;
  return y;
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
