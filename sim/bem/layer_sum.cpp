#include "sim/bem/layer_sum.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

namespace touchfield {

namespace {

constexpr Eigen::Index kBlock =
    256;                           // faces a pass: kernels of a tile and the values they meet stay in the first cache
constexpr Eigen::Index kTile = 4;  // points a tile: a value that is read meets four kernels

Layer transposed(Layer layer) {
  switch (layer) {
    case Layer::kDouble:
      return Layer::kAdjoint;
    case Layer::kBurtonMiller:
      return Layer::kAdjointMiller;
    default:
      throw std::invalid_argument("LayerSum: this layer's transpose is not made");
  }
}

template <typename Real>
struct Products {
  Real rr = 0, ii = 0, ri = 0, ir = 0;
};

template <typename Real>
Products<Real> dot(const Real* a_re, const Real* a_im, const Real* b_re, const Real* b_im, Eigen::Index count) {
  Real rr = 0;
  Real ii = 0;
  Real ri = 0;
  Real ir = 0;
#pragma omp simd reduction(+ : rr, ii, ri, ir)
  for (Eigen::Index j = 0; j < count; ++j) {
    rr += a_re[j] * b_re[j];
    ii += a_im[j] * b_im[j];
    ri += a_re[j] * b_im[j];
    ir += a_im[j] * b_re[j];
  }
  return {rr, ii, ri, ir};
}

}  // namespace

template <typename Real>
LayerSum<Real>::LayerSum(const TriangleMesh& mesh, const Complex& wavenumber, double gamma)
    : origin_(0.5 * (mesh.vertices().rowwise().minCoeff() + mesh.vertices().rowwise().maxCoeff())),
      scale_(wavenumber.real() / std::numbers::pi) {
  constants_.damping = static_cast<Real>(std::numbers::pi * wavenumber.imag() / wavenumber.real());
  constants_.gamma = static_cast<Real>(gamma * scale_);
  const auto faces = static_cast<std::size_t>(mesh.face_count());
  for (auto* values : {&x_, &y_, &z_, &nx_, &ny_, &nz_}) {
    values->resize(faces);
  }
  weight_.resize(faces);
  for (std::size_t f = 0; f < faces; ++f) {
    const auto column = static_cast<Eigen::Index>(f);
    const Vector3 x = scale_ * (mesh.centroids().col(column) - origin_);
    const Vector3 n = mesh.normals().col(column);
    x_[f] = static_cast<Real>(x.x());
    y_[f] = static_cast<Real>(x.y());
    z_[f] = static_cast<Real>(x.z());
    nx_[f] = static_cast<Real>(n.x());
    ny_[f] = static_cast<Real>(n.y());
    nz_[f] = static_cast<Real>(n.z());
    weight_[f] = mesh.areas()(column) * scale_ * scale_ / (4.0 * std::numbers::pi);
  }
}

template <typename Real>
PairPoint<Real> LayerSum<Real>::point(Eigen::Index i) const {
  const auto f = static_cast<std::size_t>(i);
  return {x_[f], y_[f], z_[f], nx_[f], ny_[f], nz_[f]};
}

template <typename Real>
void LayerSum<Real>::fill(Layer layer, const PairPoint<Real>& at, Eigen::Index first, Eigen::Index count, Real* re,
                          Real* im) const {
  const PairSources<Real> sources{x_.data() + first,  y_.data() + first,  z_.data() + first,
                                  nx_.data() + first, ny_.data() + first, nz_.data() + first};
  pair_values(layer, constants_, at, sources, static_cast<int>(count), re, im);
}

template <typename Real>
Eigen::VectorXd LayerSum<Real>::weights() const {
  return Eigen::Map<const Eigen::VectorXd>(weight_.data(), size());
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::sums(Layer layer, const Eigen::MatrixXcd& weighted, Eigen::Index rows) const {
  using Values = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  const Values re = weighted.real().template cast<Real>();
  const Values im = weighted.imag().template cast<Real>();
  const Eigen::Index columns = weighted.cols();
  Eigen::MatrixXcd y(rows, columns);
  const Eigen::Index tiles = (rows + kTile - 1) / kTile;
#pragma omp parallel
  {
    Eigen::MatrixXcd sum(columns, kTile);
    alignas(64) std::array<Real, kTile * kBlock> k_re{};
    alignas(64) std::array<Real, kTile * kBlock> k_im{};
#pragma omp for schedule(static)
    for (Eigen::Index tile = 0; tile < tiles; ++tile) {
      const Eigen::Index begin = tile * kTile;
      const Eigen::Index points = std::min(kTile, rows - begin);
      sum.setZero();
      for (Eigen::Index first = 0; first < size(); first += kBlock) {
        const Eigen::Index count = std::min(kBlock, size() - first);
        for (Eigen::Index t = 0; t < points; ++t) {
          fill(layer, point(begin + t), first, count, k_re.data() + t * kBlock, k_im.data() + t * kBlock);
        }
        for (Eigen::Index s = 0; s < columns; ++s) {
          for (Eigen::Index t = 0; t < points; ++t) {
            const Products<Real> p = dot(k_re.data() + t * kBlock, k_im.data() + t * kBlock, re.col(s).data() + first,
                                         im.col(s).data() + first, count);
            sum(s, t) += Complex(static_cast<double>(p.rr - p.ii), static_cast<double>(p.ri + p.ir));
          }
        }
      }
      y.middleRows(begin, points) = sum.leftCols(points).transpose();
    }
  }
  return y;
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::apply(Layer layer, const Eigen::MatrixXcd& x) const {
  return apply_head(layer, x, size());
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::apply_head(Layer layer, const Eigen::MatrixXcd& x, Eigen::Index rows) const {
  if (x.rows() != size() || rows > size()) {
    throw std::invalid_argument("LayerSum: the block has another number of rows than the mesh has faces");
  }
  Eigen::MatrixXcd y = sums(layer, weights().asDiagonal() * x, rows);
  if (layer == Layer::kSingle || layer == Layer::kSingleAdjoint) {
    y /= scale_;
  }
  return y;
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const {
  if (x.rows() != size()) {
    throw std::invalid_argument("LayerSum: the block has another number of rows than the mesh has faces");
  }
  return weights().asDiagonal() * sums(transposed(layer), x, size());
}

template <typename Real>
void LayerSum<Real>::column(Layer layer, Eigen::Index j,
                            Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1>& values) const {
  values.resize(size());
  const Layer kernel = transposed(layer);
  const PairPoint<Real> p = point(j);
  const auto weight = static_cast<Real>(weight_[static_cast<std::size_t>(j)]);
  alignas(64) std::array<Real, kBlock> re{};
  alignas(64) std::array<Real, kBlock> im{};
  for (Eigen::Index first = 0; first < size(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, size() - first);
    fill(kernel, p, first, count, re.data(), im.data());
    for (Eigen::Index i = 0; i < count; ++i) {
      values(first + i) = {weight * re[static_cast<std::size_t>(i)], weight * im[static_cast<std::size_t>(i)]};
    }
  }
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::rows(Layer layer, const Points& points) const {
  Eigen::MatrixXcd values(points.cols(), size());
  const double unit = layer == Layer::kSingle ? 1.0 / scale_ : 1.0;
#pragma omp parallel for schedule(static)
  for (Eigen::Index z = 0; z < points.cols(); ++z) {
    const Vector3 x = scale_ * (points.col(z) - origin_);
    const PairPoint<Real> p{static_cast<Real>(x.x()), static_cast<Real>(x.y()), static_cast<Real>(x.z()), 0, 0, 0};
    std::array<Real, kBlock> re{};
    std::array<Real, kBlock> im{};
    for (Eigen::Index first = 0; first < size(); first += kBlock) {
      const Eigen::Index count = std::min(kBlock, size() - first);
      fill(layer, p, first, count, re.data(), im.data());
      for (Eigen::Index i = 0; i < count; ++i) {
        const double weight = unit * weight_[static_cast<std::size_t>(first + i)];
        values(z, first + i) = weight * Complex(re[static_cast<std::size_t>(i)], im[static_cast<std::size_t>(i)]);
      }
    }
  }
  return values;
}

template class LayerSum<float>;
template class LayerSum<double>;

}  // namespace touchfield
