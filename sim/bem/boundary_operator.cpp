#include "sim/bem/boundary_operator.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/core/box_tree.h"

namespace touchfield {

namespace {

constexpr FaceRule kOnePoint = {0.0, 0.0, 0.0};

void add_faces(const TriangleMesh& mesh, const std::vector<std::int32_t>& faces, const Vector3& x, const Vector3& m,
               FaceQuadrature& quadrature) {
  quadrature.begin(x, m);
  for (const int f : faces) {
    quadrature.add(face_of(mesh, f));
  }
}

/// Of each face the others whose centroid is nearer to its own than `reach` times the root of their area, ascending.
std::vector<std::vector<std::int32_t>> near_faces(const TriangleMesh& mesh, double reach) {
  const auto count = static_cast<int>(mesh.face_count());
  const Eigen::VectorXd reach_squared = reach * reach * mesh.areas();
  std::vector<Box> boxes;
  for (Eigen::Index f = 0; f < count; ++f) {
    const Vector3 half = Vector3::Constant((1.0 + 1e-9) * std::sqrt(reach_squared(f)));
    boxes.emplace_back(mesh.centroids().col(f) - half, mesh.centroids().col(f) + half);
  }
  const BoxTree tree(boxes);
  std::vector<std::vector<std::int32_t>> faces(static_cast<std::size_t>(count));
#pragma omp parallel
  {
    std::vector<std::int32_t> met;
    std::vector<int> found;
    Eigen::Matrix<double, Eigen::Dynamic, 4> place;  // of those met: centroid, reach squared
#pragma omp for schedule(dynamic, 64)
    for (int i = 0; i < count; ++i) {
      const Vector3 x = mesh.centroids().col(i);
      met.clear();
      tree.for_each_meeting(Box(x, x), [&](Eigen::Index j) {
        if (j != i) {
          met.push_back(static_cast<std::int32_t>(j));
        }
      });
      std::sort(met.begin(), met.end());
      const auto size = static_cast<Eigen::Index>(met.size());
      place.resize(size, 4);
      for (Eigen::Index q = 0; q < size; ++q) {
        const std::int32_t j = met[static_cast<std::size_t>(q)];
        place.row(q) << mesh.centroids().col(j).transpose(), reach_squared(j);
      }
      found.resize(met.size());
      const PairSources<double> sources{
          place.col(0).data(), place.col(1).data(), place.col(2).data(), nullptr, nullptr, nullptr};
      found.resize(static_cast<std::size_t>(pair_loops().near_sources(
          {x.x(), x.y(), x.z(), 0, 0, 0}, sources, place.col(3).data(), static_cast<int>(size), found.data())));
      std::vector<std::int32_t>& near = faces[static_cast<std::size_t>(i)];
      near.reserve(found.size());
      for (const int q : found) {
        near.push_back(met[static_cast<std::size_t>(q)]);
      }
    }
  }
  return faces;
}

}  // namespace

NearCorrections::NearCorrections(const TriangleMesh& mesh, const Complex& wavenumber, double gamma, Layer layer,
                                 const FaceRule& rule, Numbers numbers) {
  const auto count = static_cast<int>(mesh.face_count());
  std::vector<std::vector<std::int32_t>> columns = near_faces(mesh, std::max(rule.three_below, rule.seven_below));
  start_.assign(static_cast<std::size_t>(count) + 1, 0);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    start_[i + 1] = start_[i] + columns[i].size();
  }
  columns_.resize(start_.back());
  (numbers == Numbers::kDouble ? values_.resize(start_.back()) : singles_.resize(start_.back()));
#pragma omp parallel
  {
    FaceQuadrature quadrature(wavenumber, gamma, rule);
    FaceQuadrature one_point(wavenumber, gamma, kOnePoint);
#pragma omp for schedule(dynamic, 64)
    for (int i = 0; i < count; ++i) {
      const auto row = static_cast<std::size_t>(i);
      const std::vector<std::int32_t> near = std::move(columns[row]);
      const Vector3 x = mesh.centroids().col(i);
      const Vector3 m = mesh.normals().col(i);
      add_faces(mesh, near, x, m, quadrature);
      add_faces(mesh, near, x, m, one_point);
      const std::vector<Complex>& all = quadrature.integrals(layer);
      const std::vector<Complex>& one = one_point.integrals(layer);
      for (std::size_t q = 0; q < near.size(); ++q) {
        const Complex lacking = all[q] - one[q];
        columns_[start_[row] + q] = near[q];
        if (numbers == Numbers::kDouble) {
          values_[start_[row] + q] = lacking;
        } else {
          singles_[start_[row] + q] = static_cast<std::complex<float>>(lacking);
        }
      }
    }
  }
}

void NearCorrections::add_product(const Complex& factor, const Eigen::MatrixXcd& x, Eigen::MatrixXcd& y) const {
  with_values([&](const auto& values) {
#pragma omp parallel for schedule(static)
    for (Eigen::Index i = 0; i < size(); ++i) {
      for (Eigen::Index s = 0; s < x.cols(); ++s) {
        Complex sum = 0;
        for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
          sum += Complex(values[q]) * x(columns_[q], s);
        }
        y(i, s) += factor * sum;
      }
    }
  });
}

void NearCorrections::add_row(double factor, Eigen::Index face, const std::vector<std::int32_t>& places,
                              Eigen::VectorXcf& row) const {
  with_values([&](const auto& values) {
    const auto i = static_cast<std::size_t>(face);
    for (std::size_t q = start_[i]; q < start_[i + 1]; ++q) {
      if (const std::int32_t at = places[static_cast<std::size_t>(columns_[q])]; at >= 0) {
        row(at) += static_cast<std::complex<float>>(factor * Complex(values[q]));
      }
    }
  });
}

void NearCorrections::add_transposed_product(const Complex& factor, const Eigen::MatrixXcd& x,
                                             Eigen::MatrixXcd& y) const {
  // Parts of the rows have sums of their own, as many whatever the threads are.
  constexpr Eigen::Index kParts = 16;
  const Eigen::Index parts = size() < 64 * kParts || x.cols() > kParts ? 1 : kParts;
  Eigen::MatrixXcd sums = Eigen::MatrixXcd::Zero(size(), parts * x.cols());
  with_values([&](const auto& values) {
#pragma omp parallel for schedule(dynamic) collapse(2)
    for (Eigen::Index s = 0; s < x.cols(); ++s) {
      for (Eigen::Index part = 0; part < parts; ++part) {
        auto sum = sums.col(s * parts + part);
        for (Eigen::Index i = part * size() / parts; i < (part + 1) * size() / parts; ++i) {
          const Complex value = factor * x(i, s);
          for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
            sum(columns_[q]) += Complex(values[q]) * value;
          }
        }
      }
    }
  });
  for (Eigen::Index s = 0; s < x.cols(); ++s) {
    y.col(s) += sums.middleCols(s * parts, parts).rowwise().sum();
  }
}

template <typename Real>
void NearCorrections::add_to(const Complex& factor,
                             Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& matrix) const {
  with_values([&](const auto& values) {
#pragma omp parallel for schedule(static)
    for (Eigen::Index i = 0; i < size(); ++i) {
      for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
        matrix(i, columns_[q]) += static_cast<std::complex<Real>>(factor * Complex(values[q]));
      }
    }
  });
}

void NearCorrections::add_columns(const Complex& factor, const std::vector<Eigen::Index>& faces,
                                  Eigen::MatrixXcd& columns) const {
  std::vector<Eigen::Index> place(static_cast<std::size_t>(size()), -1);
  for (std::size_t c = 0; c < faces.size(); ++c) {
    place[static_cast<std::size_t>(faces[c])] = static_cast<Eigen::Index>(c);
  }
  with_values([&](const auto& values) {
#pragma omp parallel for schedule(static)
    for (Eigen::Index i = 0; i < size(); ++i) {
      for (std::size_t q = start_[static_cast<std::size_t>(i)]; q < start_[static_cast<std::size_t>(i) + 1]; ++q) {
        const Eigen::Index column = place[static_cast<std::size_t>(columns_[q])];
        if (column >= 0) {
          columns(i, column) += factor * Complex(values[q]);
        }
      }
    }
  });
}

template void NearCorrections::add_to(const Complex&, Eigen::MatrixXcf&) const;
template void NearCorrections::add_to(const Complex&, Eigen::MatrixXcd&) const;

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

SummedOperator::SummedOperator(std::shared_ptr<const FaceSums> sums, BoundaryParts parts)
    : sums_(std::move(sums)), parts_(std::move(parts)) {
  if (parts_.diagonal.size() != size()) {
    throw std::invalid_argument("BoundaryOperator: the diagonal must have one value a face");
  }
}

Eigen::MatrixXcd SummedOperator::apply(const Eigen::MatrixXcd& x) const {
  Eigen::MatrixXcd y = -sums_->apply(parts_.layer, x);
  if (parts_.near) {
    parts_.near->add_product(-1.0, x, y);
  }
  y += parts_.diagonal.asDiagonal() * x;
  return y;
}

Eigen::MatrixXcd SummedOperator::apply_transpose(const Eigen::MatrixXcd& x) const {
  Eigen::MatrixXcd y = -sums_->apply_transpose(parts_.layer, x);
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
      sum_.column(parts().layer, j, column);
      matrix.col(j).head(size()) = -column;
    }
  }
  if (parts().near) {
    parts().near->template add_to<Real>(-1.0, matrix);
  }
  matrix.diagonal().head(size()) += parts().diagonal.template cast<std::complex<Real>>();
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
      sum_.column(parts().layer, faces[static_cast<std::size_t>(c)], column);
      columns.col(c) = -column.template cast<Complex>();
    }
  }
  if (parts().near) {
    parts().near->add_columns(-1.0, faces, columns);
  }
  for (Eigen::Index c = 0; c < count; ++c) {
    const Eigen::Index f = faces[static_cast<std::size_t>(c)];
    columns(f, c) += parts().diagonal(f);
  }
  return columns;
}

template class BoundaryOperator<float>;
template class BoundaryOperator<double>;

Eigen::MatrixXcd ChiefOperator::apply(const Eigen::MatrixXcd& x) const {
  return b_->apply(x) + rows_.adjoint() * (rows_ * x);
}

Eigen::MatrixXcd ChiefOperator::apply_transpose(const Eigen::MatrixXcd& x) const {
  return b_->apply_transpose(x) + rows_.transpose() * (rows_.conjugate() * x);
}

}  // namespace touchfield
