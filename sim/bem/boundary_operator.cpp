#include "sim/bem/boundary_operator.h"

#include <stdexcept>
#include <utility>

namespace touchfield {

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

}  // namespace touchfield
