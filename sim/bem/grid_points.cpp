#include "sim/bem/grid_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/bem/grid_convolution.h"

namespace touchfield {

namespace {

constexpr double kCells = 2.0;  // cells a reach, by which points are sorted

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

}  // namespace touchfield
