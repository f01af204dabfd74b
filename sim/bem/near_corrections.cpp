#include "sim/bem/near_corrections.h"

#include <algorithm>
#include <iterator>

#include "sim/bem/face_arrays.h"

namespace touchfield {

namespace {

constexpr FaceRule kOnePoint = {0.0, 0.0, 0.0};

void add_faces(const TriangleMesh& mesh, const std::vector<int>& faces, const Vector3& x, const Vector3& m,
               FaceQuadrature& quadrature) {
  quadrature.begin(x, m);
  for (const int f : faces) {
    quadrature.add(face_of(mesh, f));
  }
}

}  // namespace

NearCorrections::NearCorrections(const TriangleMesh& mesh, const Complex& wavenumber, double gamma, Layer layer,
                                 const FaceRule& rule) {
  const FaceArrays<double> faces(mesh);
  const PairSources<double> sources = faces.sources();
  const auto count = static_cast<int>(faces.size());
  const double reach = std::max(rule.three_below, rule.seven_below);
  const Eigen::VectorXd reach_squared = reach * reach * faces.area;
  std::vector<std::vector<std::int32_t>> columns(static_cast<std::size_t>(count));
  std::vector<std::vector<Complex>> values(static_cast<std::size_t>(count));
#pragma omp parallel
  {
    FaceQuadrature quadrature(wavenumber, gamma, rule);
    FaceQuadrature one_point(wavenumber, gamma, kOnePoint);
    std::vector<int> near(static_cast<std::size_t>(count));
    std::vector<int> others;
#pragma omp for schedule(dynamic, 64)
    for (int i = 0; i < count; ++i) {
      const int found = pair_loops().near_sources(faces.point(i), sources, reach_squared.data(), count, near.data());
      others.clear();
      std::copy_if(near.begin(), near.begin() + found, std::back_inserter(others), [i](int j) { return j != i; });
      const Vector3 x = mesh.centroids().col(i);
      const Vector3 m = mesh.normals().col(i);
      add_faces(mesh, others, x, m, quadrature);
      add_faces(mesh, others, x, m, one_point);
      const auto row = static_cast<std::size_t>(i);
      values[row] = quadrature.integrals(layer);
      const std::vector<Complex>& one = one_point.integrals(layer);
      for (std::size_t q = 0; q < one.size(); ++q) {
        values[row][q] -= one[q];
      }
      columns[row].assign(others.begin(), others.end());
    }
  }
  start_.assign(static_cast<std::size_t>(count) + 1, 0);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    start_[i + 1] = start_[i] + columns[i].size();
  }
  columns_.resize(start_.back());
  values_.resize(start_.back());
#pragma omp parallel for schedule(static)
  for (int i = 0; i < count; ++i) {
    const auto row = static_cast<std::size_t>(i);
    std::copy(columns[row].begin(), columns[row].end(), columns_.begin() + static_cast<std::ptrdiff_t>(start_[row]));
    std::copy(values[row].begin(), values[row].end(), values_.begin() + static_cast<std::ptrdiff_t>(start_[row]));
    columns[row] = {};
    values[row] = {};
  }
}

void NearCorrections::add_product(const Complex& factor, const Eigen::MatrixXcd& x, Eigen::MatrixXcd& y) const {
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (Eigen::Index s = 0; s < x.cols(); ++s) {
      Complex sum = 0;
      for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
        sum += values_[q] * x(columns_[q], s);
      }
      y(i, s) += factor * sum;
    }
  }
}

void NearCorrections::add_transposed_product(const Complex& factor, const Eigen::MatrixXcd& x,
                                             Eigen::MatrixXcd& y) const {
  // Columns of x are independent; with one column the rows' scattered sums leave nothing to share.
#pragma omp parallel for schedule(static)
  for (Eigen::Index s = 0; s < x.cols(); ++s) {
    for (Eigen::Index i = 0; i < size(); ++i) {
      const Complex value = factor * x(i, s);
      for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
        y(columns_[q], s) += values_[q] * value;
      }
    }
  }
}

template <typename Real>
void NearCorrections::add_to(const Complex& factor,
                             Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& matrix) const {
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
      matrix(i, columns_[q]) += static_cast<std::complex<Real>>(factor * values_[q]);
    }
  }
}

void NearCorrections::add_columns(const Complex& factor, const std::vector<Eigen::Index>& faces,
                                  Eigen::MatrixXcd& columns) const {
  std::vector<Eigen::Index> place(static_cast<std::size_t>(size()), -1);
  for (std::size_t c = 0; c < faces.size(); ++c) {
    place[static_cast<std::size_t>(faces[c])] = static_cast<Eigen::Index>(c);
  }
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
      const Eigen::Index column = place[static_cast<std::size_t>(columns_[q])];
      if (column >= 0) {
        columns(i, column) += factor * values_[q];
      }
    }
  }
}

template void NearCorrections::add_to(const Complex&, Eigen::MatrixXcf&) const;
template void NearCorrections::add_to(const Complex&, Eigen::MatrixXcd&) const;

}  // namespace touchfield
