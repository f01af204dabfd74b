#include "sim/bem/operators.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>

namespace touchfield {

namespace {

constexpr double kDiagonal = 0.5;     // of scheme `paper`: a flat face does not see itself
constexpr Eigen::Index kBlock = 256;  // faces a pass: what a pass reads and writes stays in the first cache

void fill_column(const FaceArrays& faces, const Complex& wavenumber, Eigen::Index j, Eigen::VectorXd& re,
                 Eigen::VectorXd& im, Eigen::Ref<Eigen::VectorXcd> column) {
  double_layer_column(faces, j, wavenumber, re.data(), im.data());
  column.real() = -re;
  column.imag() = -im;
  column(j) = kDiagonal;
}

void require_rows(const Eigen::MatrixXcd& x, Eigen::Index size) {
  if (x.rows() != size) {
    throw std::invalid_argument("PaperOperator: the block has another number of rows than the operator");
  }
}

}  // namespace

Eigen::MatrixXcd paper_matrix(const TriangleMesh& mesh, const Wave& wave) {
  std::vector<Eigen::Index> all(static_cast<std::size_t>(mesh.face_count()));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  return paper_columns(mesh, wave, all);
}

Eigen::MatrixXcd paper_columns(const TriangleMesh& mesh, const Wave& wave, const std::vector<Eigen::Index>& faces) {
  const FaceArrays arrays(mesh);
  const auto count = static_cast<Eigen::Index>(faces.size());
  Eigen::MatrixXcd b(mesh.face_count(), count);
#pragma omp parallel
  {
    Eigen::VectorXd re(mesh.face_count());
    Eigen::VectorXd im(mesh.face_count());
#pragma omp for schedule(static)
    for (Eigen::Index column = 0; column < count; ++column) {
      fill_column(arrays, wave.wavenumber(), faces[static_cast<std::size_t>(column)], re, im, b.col(column));
    }
  }
  return b;
}

PaperOperator::PaperOperator(const TriangleMesh& mesh, const Wave& wave) : faces_(mesh), wave_(wave) {}

Eigen::MatrixXcd PaperOperator::apply(const Eigen::MatrixXcd& x) const {
  require_rows(x, size());
  const Eigen::MatrixXd x_re = x.real();
  const Eigen::MatrixXd x_im = x.imag();
  Eigen::MatrixXcd y(size(), x.cols());
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < size(); ++i) {
    const Vector3 point(faces_.x(i), faces_.y(i), faces_.z(i));
    std::array<double, kBlock> re{};
    std::array<double, kBlock> im{};
    auto sum = y.row(i);
    sum = kDiagonal * x.row(i);
    for (Eigen::Index first = 0; first < size(); first += kBlock) {
      const Eigen::Index count = std::min(kBlock, size() - first);
      double_layer_weights(faces_, point, wave_.wavenumber(), first, count, re.data(), im.data());
      if (i >= first && i < first + count) {
        re[static_cast<std::size_t>(i - first)] = 0.0;
        im[static_cast<std::size_t>(i - first)] = 0.0;
      }
      const Eigen::Map<const Eigen::VectorXd> w_re(re.data(), count);
      const Eigen::Map<const Eigen::VectorXd> w_im(im.data(), count);
      for (Eigen::Index s = 0; s < x.cols(); ++s) {
        const auto p_re = x_re.col(s).segment(first, count);
        const auto p_im = x_im.col(s).segment(first, count);
        sum(s) -= Complex(w_re.dot(p_re) - w_im.dot(p_im), w_re.dot(p_im) + w_im.dot(p_re));
      }
    }
  }
  return y;
}

Eigen::MatrixXcd PaperOperator::apply_transpose(const Eigen::MatrixXcd& x) const {
  require_rows(x, size());
  const Eigen::MatrixXd x_re = x.real();
  const Eigen::MatrixXd x_im = x.imag();
  Eigen::MatrixXcd y(size(), x.cols());
#pragma omp parallel
  {
    Eigen::VectorXd re(size());
    Eigen::VectorXd im(size());
#pragma omp for schedule(static)
    for (Eigen::Index j = 0; j < size(); ++j) {
      double_layer_column(faces_, j, wave_.wavenumber(), re.data(), im.data());
      re(j) = -kDiagonal;
      im(j) = 0.0;
      for (Eigen::Index s = 0; s < x.cols(); ++s) {
        y(j, s) = -Complex(re.dot(x_re.col(s)) - im.dot(x_im.col(s)), re.dot(x_im.col(s)) + im.dot(x_re.col(s)));
      }
    }
  }
  return y;
}

}  // namespace touchfield
