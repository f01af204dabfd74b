#include "sim/bem/grid_sum.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

namespace touchfield {

namespace {

constexpr double kCells = 2.0;  // cells a reach, by which faces are sorted

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
GridSum<Real>::GridSum(const TriangleMesh& mesh, const Complex& wavenumber, double gamma, const GridSpec& spec)
    : spec_(spec),
      gamma_(gamma),
      local_(KernelSplit(wavenumber, spec.reach, spec.shape).local<Real>(gamma)),
      window_(KaiserWindow(spec.width, spec.window_shape).polynomials<Real>()),
      side_(std::max(1, static_cast<int>(std::ceil(spec.reach / (kCells * spec.step))))),
      area_(mesh.areas()),
      convolution_(KernelSplit(wavenumber, spec.reach, spec.shape), spec, extent(mesh)) {
  sort_faces(mesh);
}

template <typename Real>
void GridSum<Real>::sort_faces(const TriangleMesh& mesh) {
  const Vector3 origin = lowest(mesh);
  const Vector3 size = extent(mesh);
  for (int a = 0; a < 3; ++a) {
    cells_[static_cast<std::size_t>(a)] = 1 + static_cast<int>(std::floor(size(a) / spec_.step)) / side_;
  }
  const Eigen::Index count = mesh.face_count();
  const Points place = (mesh.centroids().colwise() - origin) / spec_.step;
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
  face_.resize(static_cast<std::size_t>(count));
  for (Eigen::Index f = 0; f < count; ++f) {
    face_[static_cast<std::size_t>(next[static_cast<std::size_t>(cell_of[static_cast<std::size_t>(f)])]++)] = f;
  }
  const GridView<Real> grid = convolution_.grid();
  first_.resize(face_.size());
  geometry_.resize(count, 9);
  for (Eigen::Index p = 0; p < count; ++p) {
    const Eigen::Index f = face_[static_cast<std::size_t>(p)];
    first_[static_cast<std::size_t>(p)] = step(0, f) * grid.x_stride + step(1, f) * grid.y_stride + step(2, f);
    const Vector3 in_step = place.col(f) - step.col(f).cast<double>();
    const Vector3 middle = side_ * ((step.col(f) / side_).cast<double>() + Vector3::Constant(0.5));
    const Vector3 in_cell = (place.col(f) - middle) * (spec_.step / spec_.reach);
    geometry_.row(p).template segment<3>(0) = in_step.cast<Real>().transpose();
    geometry_.row(p).template segment<3>(3) = mesh.normals().col(f).cast<Real>().transpose();
    geometry_.row(p).template segment<3>(6) = in_cell.cast<Real>().transpose();
  }
}

template <typename Real>
void GridSum<Real>::add_local(Layer layer, const Values& re, const Values& im, Values& sum_re, Values& sum_im) const {
  const GridLoopTableOf<Real>& loops = grid_loops_of<Real>();
  const auto columns = static_cast<int>(re.cols());
  const auto cells = static_cast<int>(start_.size()) - 1;
  const auto cell_size = static_cast<Real>(side_ * spec_.step / spec_.reach);
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
    for (int c = 0; c < cells; ++c) {
      const int begin = start_[static_cast<std::size_t>(c)];
      const int end = start_[static_cast<std::size_t>(c) + 1];
      if (begin == end) {
        continue;
      }
      Vector low = Vector::Constant(cell_size);
      Vector high = -low;
      for (int p = begin; p < end; ++p) {
        low = low.cwiseMin(in_cell(p));
        high = high.cwiseMax(in_cell(p));
      }
      const int z = c % cells_[2];
      const int y = c / cells_[2] % cells_[1];
      const int x = c / cells_[2] / cells_[1];
      near.clear();
      place.clear();
      for (int i = std::max(0, x - far); i <= std::min(cells_[0] - 1, x + far); ++i) {
        for (int j = std::max(0, y - far); j <= std::min(cells_[1] - 1, y + far); ++j) {
          for (int k = std::max(0, z - far); k <= std::min(cells_[2] - 1, z + far); ++k) {
            const Vector shift = cell_size * Eigen::Vector3i(i - x, j - y, k - z).cast<Real>();
            const auto other = static_cast<std::size_t>(cell(i, j, k));
            for (int p = start_[other]; p < start_[other + 1]; ++p) {
              const Vector at = in_cell(p) + shift;
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
          row(3 + a)[q] = geometry_(p, 3 + a);
        }
        for (int s = 0; s < columns; ++s) {
          row(6 + s)[q] = re(p, s);
          row(6 + columns + s)[q] = im(p, s);
        }
      }
      for (int p = begin; p < end; ++p) {
        const Vector at = in_cell(p);
        loops.local(layer, local_, {at.x(), at.y(), at.z(), geometry_(p, 3), geometry_(p, 4), geometry_(p, 5)},
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
  const GridLoopTableOf<Real>& loops = grid_loops_of<Real>();
  const LayerParts parts = parts_of(layer);
  const auto count = static_cast<int>(size());
  const auto gamma = static_cast<Real>(gamma_);
  const GridWindow<Real> window{spec_.width, KaiserWindow(spec_.width, 0.0).lanes(), window_.data()};
  const GridView<Real> grid = convolution_.grid();
  const Eigen::Matrix<Real, Eigen::Dynamic, 3> normals =
      geometry_.template middleCols<3>(3) / static_cast<Real>(spec_.step);
  const GridFaces<Real> faces{first_.data(),           geometry_.col(0).data(), geometry_.col(1).data(),
                              geometry_.col(2).data(), normals.col(0).data(),   normals.col(1).data(),
                              normals.col(2).data()};
  // Tiles of columns of cells: those of one colour are apart by a window.
  const int tile = (spec_.width - 1 + side_ - 1) / side_;
  const int tiles_x = (cells_[0] + tile - 1) / tile;
  const int tiles_y = (cells_[1] + tile - 1) / tile;
  Values made(count, 4);
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
    for (int colour = 0; colour < 4; ++colour) {
#pragma omp parallel for schedule(dynamic) collapse(2)
      for (int tx = colour / 2; tx < tiles_x; tx += 2) {
        for (int ty = colour % 2; ty < tiles_y; ty += 2) {
          for (int x = tx * tile; x < std::min(cells_[0], (tx + 1) * tile); ++x) {
            const int last = std::min(cells_[1], (ty + 1) * tile);
            loops.spread(window, faces, spread, start_[static_cast<std::size_t>(cell(x, ty * tile, 0))],
                         start_[static_cast<std::size_t>(cell(x, last, 0))], grid);
          }
        }
      }
    }
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
    constexpr int kChunk = 256;
#pragma omp parallel for schedule(dynamic)
    for (int first = 0; first < count; first += kChunk) {
      loops.interpolate(window, faces, read, first, std::min(count, first + kChunk), grid);
    }
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
      const Complex value = sources(face_[static_cast<std::size_t>(p)], s);
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
      y(face_[static_cast<std::size_t>(p)], s) =
          Complex(static_cast<double>(sum_re(p, s)), static_cast<double>(sum_im(p, s)));
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

template class GridSum<float>;
template class GridSum<double>;

}  // namespace touchfield
