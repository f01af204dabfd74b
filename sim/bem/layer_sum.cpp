#include "sim/bem/layer_sum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <omp.h>

#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kBlock =
    256;                             // faces a pass: kernels of a tile and the values they meet stay in the first cache
constexpr Eigen::Index kTile = 4;    // points a tile: a value that is read meets four kernels
constexpr Eigen::Index kPanel = 64;  // points a panel: enough for GEMM to run at its speed
constexpr Eigen::Index kManyColumns = 12;  // from here on GEMM with kernels made once a point is the fastest

void require_rows(const Eigen::MatrixXcd& x, Eigen::Index rows) {
  if (x.rows() != rows) {
    throw std::invalid_argument("LayerSum: the block has another number of rows than the mesh has faces");
  }
}

}  // namespace

template <typename Real>
FaceArrays<Real>::FaceArrays(const TriangleMesh& mesh, double scale, const Vector3& origin)
    : nx(mesh.normals().row(0).cast<Real>()),
      ny(mesh.normals().row(1).cast<Real>()),
      nz(mesh.normals().row(2).cast<Real>()),
      area(mesh.areas() * scale * scale) {
  const Points places = scale * (mesh.centroids().colwise() - origin);
  x = places.row(0).cast<Real>();
  y = places.row(1).cast<Real>();
  z = places.row(2).cast<Real>();
}

template struct FaceArrays<float>;
template struct FaceArrays<double>;

double half_wavelengths(const Complex& wavenumber) { return wavenumber.real() / std::numbers::pi; }

template <typename Real>
PairConstants<Real> pair_constants(const Complex& wavenumber, double gamma) {
  return {static_cast<Real>(std::numbers::pi * wavenumber.imag() / wavenumber.real()),
          static_cast<Real>(gamma * half_wavelengths(wavenumber))};
}

template PairConstants<float> pair_constants(const Complex&, double);
template PairConstants<double> pair_constants(const Complex&, double);

Layer transposed(Layer layer) {
  switch (layer) {
    case Layer::kDouble:
      return Layer::kAdjoint;
    case Layer::kBurtonMiller:
      return Layer::kAdjointMiller;
    default:
      throw std::invalid_argument("this layer's transpose is not made");
  }
}

template <typename Real>
LayerSum<Real>::LayerSum(const TriangleMesh& mesh, const Complex& wavenumber, double gamma)
    : origin_(0.5 * (mesh.vertices().rowwise().minCoeff() + mesh.vertices().rowwise().maxCoeff())),
      scale_(half_wavelengths(wavenumber)),
      constants_(pair_constants<Real>(wavenumber, gamma)),
      faces_(mesh, scale_, origin_),
      weight_(faces_.area / (4.0 * std::numbers::pi)) {}

template <typename Real>
void LayerSum<Real>::fill(Layer layer, const PairPoint<Real>& at, Eigen::Index first, Eigen::Index count, Real* re,
                          Real* im) const {
  pair_loops_of<Real>().values(layer, constants_, at, faces_.sources(first), static_cast<int>(count), re, im);
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::sums_by_rows(Layer layer, const Eigen::MatrixXcd& weighted, Eigen::Index rows) const {
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
          fill(layer, faces_.point(begin + t), first, count, k_re.data() + t * kBlock, k_im.data() + t * kBlock);
        }
        for (Eigen::Index s = 0; s < columns; ++s) {
          for (Eigen::Index t = 0; t < points; ++t) {
            const PairProducts<Real> p = pair_loops_of<Real>().products(
                k_re.data() + t * kBlock, k_im.data() + t * kBlock, re.col(s).data() + first, im.col(s).data() + first,
                static_cast<int>(count));
            sum(s, t) += Complex(static_cast<double>(p.rr - p.ii), static_cast<double>(p.ri + p.ir));
          }
        }
      }
      y.middleRows(begin, points) = sum.leftCols(points).transpose();
    }
  }
  return y;
}

/// Kernels of a panel of points and a block of sources are made once and meet all columns in one product.
template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::sums_by_panels(Layer layer, const Eigen::MatrixXcd& weighted) const {
  using Values = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;
  const Values values = weighted.template cast<std::complex<Real>>();
  const Eigen::Index columns = weighted.cols();
  Eigen::MatrixXcd y(size(), columns);
  const Eigen::Index panels = (size() + kPanel - 1) / kPanel;
#pragma omp parallel
  {
    Values kernels(kBlock, kPanel);
    Values products(kPanel, columns);
    Eigen::MatrixXcd sum(kPanel, columns);
    alignas(64) std::array<Real, kBlock> re{};
    alignas(64) std::array<Real, kBlock> im{};
#pragma omp for schedule(dynamic)
    for (Eigen::Index panel = 0; panel < panels; ++panel) {
      const Eigen::Index begin = panel * kPanel;
      const Eigen::Index points = std::min(kPanel, size() - begin);
      sum.setZero();
      for (Eigen::Index first = 0; first < size(); first += kBlock) {
        const Eigen::Index count = std::min(kBlock, size() - first);
        for (Eigen::Index t = 0; t < points; ++t) {
          fill(layer, faces_.point(begin + t), first, count, re.data(), im.data());
          std::complex<Real>* column = kernels.col(t).data();
          for (Eigen::Index j = 0; j < count; ++j) {
            column[j] = {re[static_cast<std::size_t>(j)], im[static_cast<std::size_t>(j)]};
          }
        }
        multiply(Op::kTransposed, kernels.topLeftCorner(count, points), Op::kPlain, values.middleRows(first, count),
                 products.topRows(points));
        sum.topRows(points) += products.topRows(points).template cast<Complex>();
      }
      y.middleRows(begin, points) = sum.topRows(points);
    }
  }
  return y;
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::sums_by_pairs(Layer layer, bool transposed, const Eigen::MatrixXcd& weighted) const {
  using Values = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Rows = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Values re = weighted.real().template cast<Real>();
  const Values im = weighted.imag().template cast<Real>();
  const Rows point_re = re;  // the values of one point side by side
  const Rows point_im = im;
  const Eigen::Index columns = weighted.cols();
  const Eigen::Index blocks = (size() + kBlock - 1) / kBlock;
  const Eigen::Index pairs = blocks * (blocks + 1) / 2;
  const auto stride = static_cast<int>(kBlock);
  std::vector<Eigen::MatrixXcd> partial(static_cast<std::size_t>(omp_get_max_threads()));
#pragma omp parallel
  {
    Eigen::MatrixXcd& y = partial[static_cast<std::size_t>(omp_get_thread_num())];
    y = Eigen::MatrixXcd::Zero(size(), columns);
    std::vector<Real> value_re(static_cast<std::size_t>(kBlock * columns));
    std::vector<Real> value_im(value_re.size());
    std::vector<Real> sum_re(value_re.size());
    std::vector<Real> sum_im(value_re.size());
    std::vector<Real> own_re(static_cast<std::size_t>(columns));
    std::vector<Real> own_im(own_re.size());
#pragma omp for schedule(static, 1)
    for (Eigen::Index pair = 0; pair < pairs; ++pair) {
      // Block row a holds a + 1 pairs.
      auto a = static_cast<Eigen::Index>((std::sqrt(8.0 * static_cast<double>(pair) + 1.0) - 1.0) / 2.0);
      a -= a * (a + 1) / 2 > pair ? 1 : 0;
      a += (a + 1) * (a + 2) / 2 <= pair ? 1 : 0;
      const Eigen::Index b = pair - a * (a + 1) / 2;
      const Eigen::Index from = b * kBlock;
      const Eigen::Index in_block = std::min(kBlock, size() - from);
      for (Eigen::Index s = 0; s < columns; ++s) {
        std::copy_n(re.col(s).data() + from, in_block, value_re.data() + s * kBlock);
        std::copy_n(im.col(s).data() + from, in_block, value_im.data() + s * kBlock);
      }
      std::fill(sum_re.begin(), sum_re.end(), Real(0));
      std::fill(sum_im.begin(), sum_im.end(), Real(0));
      const Eigen::Index last = std::min(size(), (a + 1) * kBlock);
      for (Eigen::Index i = a * kBlock; i < last; ++i) {
        // Within a block each pair once: the sources before the point.
        const Eigen::Index count = a == b ? i - from : in_block;
        if (count == 0) {
          continue;
        }
        pair_loops_of<Real>().add_mutual(
            layer, transposed, constants_, faces_.point(i), faces_.sources(from), static_cast<int>(count),
            {value_re.data(), value_im.data(), point_re.row(i).data(), point_im.row(i).data(), sum_re.data(),
             sum_im.data(), own_re.data(), own_im.data(), stride, static_cast<int>(columns)});
        for (Eigen::Index s = 0; s < columns; ++s) {
          const auto at = static_cast<std::size_t>(s);
          y(i, s) += Complex(static_cast<double>(own_re[at]), static_cast<double>(own_im[at]));
        }
      }
      for (Eigen::Index s = 0; s < columns; ++s) {
        for (Eigen::Index j = 0; j < in_block; ++j) {
          const auto at = static_cast<std::size_t>(s * kBlock + j);
          y(from + j, s) += Complex(static_cast<double>(sum_re[at]), static_cast<double>(sum_im[at]));
        }
      }
    }
  }
  Eigen::MatrixXcd y = Eigen::MatrixXcd::Zero(size(), columns);
  for (const Eigen::MatrixXcd& part : partial) {
    if (part.size() > 0) {
      y += part;
    }
  }
  return y;
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::apply(Layer layer, const Eigen::MatrixXcd& x) const {
  require_rows(x, size());
  if (layer == Layer::kDouble || layer == Layer::kBurtonMiller) {
    const Eigen::MatrixXcd weighted = weight_.asDiagonal() * x;
    return x.cols() < kManyColumns ? sums_by_pairs(layer, false, weighted) : sums_by_panels(layer, weighted);
  }
  return apply_head(layer, x, size());
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::apply_head(Layer layer, const Eigen::MatrixXcd& x, Eigen::Index rows) const {
  require_rows(x, size());
  Eigen::MatrixXcd y = sums_by_rows(layer, weight_.asDiagonal() * x, std::min(rows, size()));
  if (layer == Layer::kSingle || layer == Layer::kSingleAdjoint) {
    y /= scale_;
  }
  return y;
}

template <typename Real>
Eigen::MatrixXcd LayerSum<Real>::apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const {
  require_rows(x, size());
  if (layer != Layer::kDouble && layer != Layer::kBurtonMiller) {
    throw std::invalid_argument("LayerSum: this layer's transpose is not made");
  }
  return weight_.asDiagonal() *
         (x.cols() < kManyColumns ? sums_by_pairs(layer, true, x) : sums_by_panels(transposed(layer), x));
}

template <typename Real>
void LayerSum<Real>::row(Layer layer, Eigen::Index i,
                         Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1>& values) const {
  values.resize(size());
  alignas(64) std::array<Real, kBlock> re{};
  alignas(64) std::array<Real, kBlock> im{};
  for (Eigen::Index first = 0; first < size(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, size() - first);
    fill(layer, faces_.point(i), first, count, re.data(), im.data());
    for (Eigen::Index j = 0; j < count; ++j) {
      const auto weight = static_cast<Real>(weight_(first + j));
      values(first + j) = {weight * re[static_cast<std::size_t>(j)], weight * im[static_cast<std::size_t>(j)]};
    }
  }
}

template <typename Real>
void LayerSum<Real>::column(Layer layer, Eigen::Index j,
                            Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1>& values) const {
  values.resize(size());
  const Layer kernel = transposed(layer);
  const PairPoint<Real> p = faces_.point(j);
  const auto weight = static_cast<Real>(weight_(j));
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
        const double weight = unit * weight_(first + i);
        values(z, first + i) = weight * Complex(re[static_cast<std::size_t>(i)], im[static_cast<std::size_t>(i)]);
      }
    }
  }
  return values;
}

template class LayerSum<float>;
template class LayerSum<double>;

}  // namespace touchfield
