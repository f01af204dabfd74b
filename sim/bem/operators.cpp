#include "sim/bem/operators.h"

#include <stdexcept>

#include "sim/bem/kernel.h"

namespace touchfield {

namespace {

/// B_ij of scheme `paper`.
Complex paper_entry(const TriangleMesh& mesh, const Complex& wavenumber, Eigen::Index i, Eigen::Index j) {
  if (i == j) {
    return 0.5;
  }
  const Vector3 offset = mesh.centroids().col(i) - mesh.centroids().col(j);
  return -mesh.areas()(j) * double_layer_kernel(offset, mesh.normals().col(j), wavenumber);
}

void require_rows(const Eigen::MatrixXcd& x, Eigen::Index size) {
  if (x.rows() != size) {
    throw std::invalid_argument("PaperOperator: the block has another number of rows than the operator");
  }
}

}  // namespace

Eigen::MatrixXcd paper_matrix(const TriangleMesh& mesh, const Wave& wave) {
  const Eigen::Index m = mesh.face_count();
  Eigen::MatrixXcd b(m, m);
#pragma omp parallel for schedule(static)
  for (Eigen::Index j = 0; j < m; ++j) {
    for (Eigen::Index i = 0; i < m; ++i) {
      b(i, j) = paper_entry(mesh, wave.wavenumber(), i, j);
    }
  }
  return b;
}

Eigen::MatrixXcd paper_columns(const TriangleMesh& mesh, const Wave& wave, const std::vector<Eigen::Index>& faces) {
  const auto k = static_cast<Eigen::Index>(faces.size());
  Eigen::MatrixXcd b(mesh.face_count(), k);
#pragma omp parallel for schedule(static)
  for (Eigen::Index column = 0; column < k; ++column) {
    const Eigen::Index j = faces[static_cast<std::size_t>(column)];
    for (Eigen::Index i = 0; i < mesh.face_count(); ++i) {
      b(i, column) = paper_entry(mesh, wave.wavenumber(), i, j);
    }
  }
  return b;
}

PaperOperator::PaperOperator(const TriangleMesh& mesh, const Wave& wave) : mesh_(mesh), wave_(wave) {}

Eigen::MatrixXcd PaperOperator::apply(const Eigen::MatrixXcd& x) const {
  require_rows(x, size());
  Eigen::MatrixXcd y(size(), x.cols());
  const Eigen::MatrixXcd rows = x.transpose();  // the inner loop reads a contiguous column
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < size(); ++i) {
    auto sum = y.row(i);
    sum.setZero();
    for (Eigen::Index j = 0; j < size(); ++j) {
      sum += paper_entry(mesh_, wave_.wavenumber(), i, j) * rows.col(j).transpose();
    }
  }
  return y;
}

Eigen::MatrixXcd PaperOperator::apply_transpose(const Eigen::MatrixXcd& x) const {
  require_rows(x, size());
  Eigen::MatrixXcd y(size(), x.cols());
  const Eigen::MatrixXcd rows = x.transpose();
#pragma omp parallel for schedule(static)
  for (Eigen::Index j = 0; j < size(); ++j) {
    auto sum = y.row(j);
    sum.setZero();
    for (Eigen::Index i = 0; i < size(); ++i) {
      sum += paper_entry(mesh_, wave_.wavenumber(), i, j) * rows.col(i).transpose();
    }
  }
  return y;
}

}  // namespace touchfield
