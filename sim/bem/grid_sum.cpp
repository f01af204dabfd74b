#include "sim/bem/grid_sum.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

namespace touchfield {

namespace {

constexpr double kCells = 2.0;  // cells a reach, by which points are sorted

/// What a layer spreads, and what it reads: values and slopes, each times 1, or slopes times i gamma.
struct LayerParts {
  bool charges, dipoles, values, slopes;
};

LayerParts parts_of(Layer layer) {
  switch (layer) {
    case Layer::kSingle:
      return {true, false, true, false};
    case Layer::kDouble:
      return {false, true, true, false};
    case Layer::kAdjoint:
      return {true, false, false, true};
    case Layer::kBurtonMiller:
      return {false, true, true, true};
    case Layer::kAdjointMiller:
      return {true, true, false, true};
    case Layer::kSingleAdjoint:
      return {true, false, true, true};
  }
  throw std::logic_error("unknown layer");
}

void require_faces(const FaceSums& sums, const Eigen::MatrixXcd& x) {
  if (x.rows() != sums.size()) {
    throw std::invalid_argument("GridSum: the block has another number of rows than the mesh has faces");
  }
}

Vector3 lowest(const TriangleMesh& mesh) { return mesh.centroids().rowwise().minCoeff(); }
Vector3 extent(const TriangleMesh& mesh) { return mesh.centroids().rowwise().maxCoeff() - lowest(mesh); }

}  // namespace

template <typename Real>
GridPoints<Real>::GridPoints(const Points& points, const Points& normals, const Vector3& origin, const Vector3& extent,
                             const GridSpec& spec, const GridView<Real>& grid)
    : width_(spec.width),
      lanes_(KaiserWindow(spec.width, spec.window_shape).lanes()),
      window_(KaiserWindow(spec.width, spec.window_shape).polynomials<Real>()),
      side_(std::max(1, static_cast<int>(std::ceil(spec.reach / (kCells * spec.step))))) {
  for (int a = 0; a < 3; ++a) {
    cells_[static_cast<std::size_t>(a)] = 1 + static_cast<int>(std::floor(extent(a) / spec.step)) / side_;
  }
  const Eigen::Index count = points.cols();
  const Points place = (points.colwise() - origin) / spec.step;
  const Eigen::Matrix3Xi step = place.array().floor().cast<int>();
  std::vector<int> cell_of(static_cast<std::size_t>(count));
  start_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]) + 1, 0);
  for (Eigen::Index f = 0; f < count; ++f) {
    const int c = cell(step(0, f) / side_, step(1, f) / side_, step(2, f) / side_);
    cell_of[static_cast<std::size_t>(f)] = c;
    ++start_[static_cast<std::size_t>(c) + 1];
  }
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  std::vector<int> next(start_.begin(), start_.end() - 1);
  number_.resize(static_cast<std::size_t>(count));
  for (Eigen::Index f = 0; f < count; ++f) {
    number_[static_cast<std::size_t>(next[static_cast<std::size_t>(cell_of[static_cast<std::size_t>(f)])]++)] = f;
  }
  first_.resize(number_.size());
  geometry_.resize(count, 9);
  for (Eigen::Index p = 0; p < count; ++p) {
    const Eigen::Index f = number(p);
    first_[static_cast<std::size_t>(p)] = step(0, f) * grid.x_stride + step(1, f) * grid.y_stride + step(2, f);
    const Vector3 in_step = place.col(f) - step.col(f).cast<double>();
    const Vector3 middle = side_ * ((step.col(f) / side_).cast<double>() + Vector3::Constant(0.5));
    const Vector3 in_cell = (place.col(f) - middle) * (spec.step / spec.reach);
    geometry_.row(p).template segment<3>(0) = in_step.cast<Real>().transpose();
    geometry_.row(p).template segment<3>(3) = normals.col(f).cast<Real>().transpose();
    geometry_.row(p).template segment<3>(6) = in_cell.cast<Real>().transpose();
  }
  slopes_ = geometry_.template middleCols<3>(3) / static_cast<Real>(spec.step);
}

template <typename Real>
GridFaces<Real> GridPoints<Real>::faces() const {
  return {first_.data(),         geometry_.col(0).data(), geometry_.col(1).data(), geometry_.col(2).data(),
          slopes_.col(0).data(), slopes_.col(1).data(),   slopes_.col(2).data()};
}

template <typename Real>
void GridPoints<Real>::spread(const FaceValues<Real>& values, const GridView<Real>& grid) const {
  // Tiles of columns of cells: those of one colour are apart by a window.
  const int tile = (width_ - 1 + side_ - 1) / side_;
  const int tiles_x = (cells_[0] + tile - 1) / tile;
  const int tiles_y = (cells_[1] + tile - 1) / tile;
  for (int colour = 0; colour < 4; ++colour) {
#pragma omp parallel for schedule(dynamic) collapse(2)
    for (int tx = colour / 2; tx < tiles_x; tx += 2) {
      for (int ty = colour % 2; ty < tiles_y; ty += 2) {
        for (int x = tx * tile; x < std::min(cells_[0], (tx + 1) * tile); ++x) {
          const int last = std::min(cells_[1], (ty + 1) * tile);
          grid_loops_of<Real>().spread(window(), faces(), values, first_place(cell(x, ty * tile, 0)),
                                       first_place(cell(x, last, 0)), grid);
        }
      }
    }
  }
}

template <typename Real>
void GridPoints<Real>::interpolate(const FaceValues<Real>& values, const GridView<Real>& grid) const {
  constexpr int kChunk = 256;
  const auto count = static_cast<int>(size());
#pragma omp parallel for schedule(dynamic)
  for (int first = 0; first < count; first += kChunk) {
    grid_loops_of<Real>().interpolate(window(), faces(), values, first, std::min(count, first + kChunk), grid);
  }
}

template class GridPoints<float>;
template class GridPoints<double>;

template <typename Real>
GridSum<Real>::GridSum(const TriangleMesh& mesh, const Complex& wavenumber, double gamma, const GridSpec& spec)
    : spec_(spec),
      gamma_(gamma),
      local_(KernelSplit(wavenumber, spec.reach, spec.shape).local<Real>(gamma)),
      area_(mesh.areas()),
      convolution_(KernelSplit(wavenumber, spec.reach, spec.shape), spec, extent(mesh)),
      faces_(mesh.centroids(), mesh.normals(), lowest(mesh), extent(mesh), spec, convolution_.grid()) {}

template <typename Real>
void GridSum<Real>::add_local(Layer layer, const Values& re, const Values& im, Values& sum_re, Values& sum_im) const {
  using Vector = typename GridPoints<Real>::Vector;
  const GridLoopTableOf<Real>& loops = grid_loops_of<Real>();
  const auto columns = static_cast<int>(re.cols());
  const std::array<int, 3>& cells = faces_.cells();
  const int cell_count = cells[0] * cells[1] * cells[2];
  const auto cell_size = static_cast<Real>(faces_.side() * spec_.step / spec_.reach);
  const auto far = static_cast<int>(std::ceil(1 / cell_size));
  const bool single = layer == Layer::kSingle || layer == Layer::kSingleAdjoint;
  const auto unit = static_cast<Real>(1.0 / (4.0 * std::numbers::pi * spec_.reach * (single ? 1.0 : spec_.reach)));
#pragma omp parallel
  {
    std::vector<int> near;      // faces within reach of a cell
    std::vector<Vector> place;  // from the middle of that cell
    std::vector<Real> buffer;   // the same one array a quantity, and their values
    std::vector<Real> point(static_cast<std::size_t>(2 * columns));
#pragma omp for schedule(dynamic, 16)
    for (int c = 0; c < cell_count; ++c) {
      const int begin = faces_.first_place(c);
      const int end = faces_.first_place(c + 1);
      if (begin == end) {
        continue;
      }
      Vector low = Vector::Constant(cell_size);
      Vector high = -low;
      for (int p = begin; p < end; ++p) {
        low = low.cwiseMin(faces_.in_cell(p));
        high = high.cwiseMax(faces_.in_cell(p));
      }
      const int z = c % cells[2];
      const int y = c / cells[2] % cells[1];
      const int x = c / cells[2] / cells[1];
      near.clear();
      place.clear();
      for (int i = std::max(0, x - far); i <= std::min(cells[0] - 1, x + far); ++i) {
        for (int j = std::max(0, y - far); j <= std::min(cells[1] - 1, y + far); ++j) {
          for (int k = std::max(0, z - far); k <= std::min(cells[2] - 1, z + far); ++k) {
            const Vector shift = cell_size * Eigen::Vector3i(i - x, j - y, k - z).cast<Real>();
            const int other = faces_.cell(i, j, k);
            for (int p = faces_.first_place(other); p < faces_.first_place(other + 1); ++p) {
              const Vector at = faces_.in_cell(p) + shift;
              if ((at - at.cwiseMax(low).cwiseMin(high)).squaredNorm() < 1) {
                near.push_back(p);
                place.push_back(at);
              }
            }
          }
        }
      }
      const auto count = static_cast<int>(near.size());
      buffer.resize(near.size() * static_cast<std::size_t>(6 + 2 * columns));
      const auto row = [&](int r) { return buffer.data() + static_cast<std::ptrdiff_t>(r) * count; };
      for (int q = 0; q < count; ++q) {
        const int p = near[static_cast<std::size_t>(q)];
        for (int a = 0; a < 3; ++a) {
          row(a)[q] = place[static_cast<std::size_t>(q)](a);
          row(3 + a)[q] = faces_.normal(p)(a);
        }
        for (int s = 0; s < columns; ++s) {
          row(6 + s)[q] = re(p, s);
          row(6 + columns + s)[q] = im(p, s);
        }
      }
      for (int p = begin; p < end; ++p) {
        const Vector at = faces_.in_cell(p);
        const Vector m = faces_.normal(p);
        loops.local(layer, local_, {at.x(), at.y(), at.z(), m.x(), m.y(), m.z()},
                    {row(0), row(1), row(2), row(3), row(4), row(5)}, count, row(6), row(6 + columns), count, columns,
                    point.data(), point.data() + columns);
        for (int s = 0; s < columns; ++s) {
          sum_re(p, s) += unit * point[static_cast<std::size_t>(s)];
          sum_im(p, s) += unit * point[static_cast<std::size_t>(columns + s)];
        }
      }
    }
  }
}

template <typename Real>
void GridSum<Real>::add_smooth(Layer layer, const Values& re, const Values& im, Values& sum_re, Values& sum_im) const {
  const LayerParts parts = parts_of(layer);
  const auto gamma = static_cast<Real>(gamma_);
  Values made(size(), 4);
  for (Eigen::Index s = 0; s < re.cols(); ++s) {
    // const: what is spread is only read
    FaceValues<Real> spread{};
    if (parts.charges) {
      spread.charge_re = const_cast<Real*>(re.col(s).data());
      spread.charge_im = const_cast<Real*>(im.col(s).data());
    }
    if (parts.dipoles && parts.charges) {
      made.col(2) = -gamma * im.col(s);
      made.col(3) = gamma * re.col(s);
      spread.dipole_re = made.col(2).data();
      spread.dipole_im = made.col(3).data();
    } else if (parts.dipoles) {
      spread.dipole_re = const_cast<Real*>(re.col(s).data());
      spread.dipole_im = const_cast<Real*>(im.col(s).data());
    }
    convolution_.clear();
    faces_.spread(spread, convolution_.grid());
    convolution_.multiply();
    FaceValues<Real> read{};
    if (parts.values) {
      read.charge_re = made.col(0).data();
      read.charge_im = made.col(1).data();
    }
    if (parts.slopes) {
      read.dipole_re = made.col(2).data();
      read.dipole_im = made.col(3).data();
    }
    faces_.interpolate(read, convolution_.grid());
    if (parts.values) {
      sum_re.col(s) += made.col(0);
      sum_im.col(s) += made.col(1);
    }
    if (parts.slopes && parts.values) {
      sum_re.col(s) -= gamma * made.col(3);
      sum_im.col(s) += gamma * made.col(2);
    } else if (parts.slopes) {
      sum_re.col(s) += made.col(2);
      sum_im.col(s) += made.col(3);
    }
  }
}

template <typename Real>
Eigen::MatrixXcd GridSum<Real>::sums(Layer layer, const Eigen::MatrixXcd& sources) const {
  Values re(size(), sources.cols());
  Values im(size(), sources.cols());
  for (Eigen::Index s = 0; s < sources.cols(); ++s) {
    for (Eigen::Index p = 0; p < size(); ++p) {
      const Complex value = sources(faces_.number(p), s);
      re(p, s) = static_cast<Real>(value.real());
      im(p, s) = static_cast<Real>(value.imag());
    }
  }
  Values sum_re = Values::Zero(size(), sources.cols());
  Values sum_im = Values::Zero(size(), sources.cols());
  const std::scoped_lock lock(busy_);
  add_local(layer, re, im, sum_re, sum_im);
  add_smooth(layer, re, im, sum_re, sum_im);
  Eigen::MatrixXcd y(size(), sources.cols());
  for (Eigen::Index s = 0; s < sources.cols(); ++s) {
    for (Eigen::Index p = 0; p < size(); ++p) {
      y(faces_.number(p), s) = Complex(static_cast<double>(sum_re(p, s)), static_cast<double>(sum_im(p, s)));
    }
  }
  return y;
}

template <typename Real>
Eigen::MatrixXcd GridSum<Real>::apply(Layer layer, const Eigen::MatrixXcd& x) const {
  require_faces(*this, x);
  return sums(layer, area_.asDiagonal() * x);
}

template <typename Real>
Eigen::MatrixXcd GridSum<Real>::apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const {
  require_faces(*this, x);
  return area_.asDiagonal() * sums(transposed(layer), x);
}

std::unique_ptr<const FaceSums> make_grid_sums(const TriangleMesh& mesh, const Complex& wavenumber, double gamma,
                                               const GridSpec& spec) {
  if (spec.single) {
    return std::make_unique<GridSum<float>>(mesh, wavenumber, gamma, spec);
  }
  return std::make_unique<GridSum<double>>(mesh, wavenumber, gamma, spec);
}

namespace {

template <typename Real>
Eigen::MatrixXcd smooth_at(const TriangleMesh& mesh, const Complex& wavenumber, const GridSpec& spec,
                           const Points& points, const Eigen::MatrixXcd& x) {
  using Values = Eigen::Matrix<Real, Eigen::Dynamic, 2>;
  const Vector3 origin = lowest(mesh).cwiseMin(points.rowwise().minCoeff());
  const Vector3 size = (lowest(mesh) + extent(mesh)).cwiseMax(points.rowwise().maxCoeff()) - origin;
  GridConvolution<Real> convolution(KernelSplit(wavenumber, spec.reach, spec.shape), spec, size);
  const GridPoints<Real> faces(mesh.centroids(), mesh.normals(), origin, size, spec, convolution.grid());
  const GridPoints<Real> targets(points, Points::Zero(3, points.cols()), origin, size, spec, convolution.grid());
  Values from(faces.size(), 2);
  Values to(targets.size(), 2);
  Eigen::MatrixXcd y(points.cols(), x.cols());
  for (Eigen::Index s = 0; s < x.cols(); ++s) {
    for (Eigen::Index p = 0; p < faces.size(); ++p) {
      const Complex value = mesh.areas()(faces.number(p)) * x(faces.number(p), s);
      from.row(p) << static_cast<Real>(value.real()), static_cast<Real>(value.imag());
    }
    convolution.clear();
    faces.spread({nullptr, nullptr, from.col(0).data(), from.col(1).data()}, convolution.grid());
    convolution.multiply();
    targets.interpolate({to.col(0).data(), to.col(1).data(), nullptr, nullptr}, convolution.grid());
    for (Eigen::Index p = 0; p < targets.size(); ++p) {
      y(targets.number(p), s) = Complex(static_cast<double>(to(p, 0)), static_cast<double>(to(p, 1)));
    }
  }
  return y;
}

}  // namespace

Eigen::MatrixXcd smooth_double_layer(const TriangleMesh& mesh, const Complex& wavenumber, const GridSpec& spec,
                                     const Points& points, const Eigen::MatrixXcd& x) {
  return spec.single ? smooth_at<float>(mesh, wavenumber, spec, points, x)
                     : smooth_at<double>(mesh, wavenumber, spec, points, x);
}

template class GridSum<float>;
template class GridSum<double>;

}  // namespace touchfield
