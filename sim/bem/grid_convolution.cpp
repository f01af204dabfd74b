#include "sim/bem/grid_convolution.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/bem/polynomials.h"

namespace touchfield {

namespace {

std::vector<int> radices_of(int n) {
  std::vector<int> radices;
  for (const int radix : {5, 3, 4, 2}) {
    for (; n % radix == 0; n /= radix) {
      radices.push_back(radix);
    }
  }
  return radices;
}

int whole_rows(int n, int lanes) { return (n + lanes - 1) / lanes * lanes; }

/// Where the kernel is sampled for point i of a period along an axis: i steps away as far as the body reaches, rounded
/// off towards half the period so that the kernel is smooth there,
///
///   P/2 - int b(s) |y - s| ds,   y = P/2 - i, b a Kaiser-Bessel bump of integral 1 on |s| < margin
double continued(int i, int period, double margin, double shape) {
  const double y = 0.5 * period - i;
  if (y >= margin) {
    return i;
  }
  const KaiserWindow bump(2, shape);
  double mass = 0;
  double sum = 0;
  for (const auto& [from, to] : {std::pair(-margin, y), std::pair(y, margin)}) {
    for (std::size_t q = 0; q < kGaussNode.size(); ++q) {
      for (const double side : {-1.0, 1.0}) {
        const double s = 0.5 * (from + to) + 0.5 * (to - from) * side * kGaussNode[q];
        const double weight = 0.5 * (to - from) * kGaussWeight[q] * bump.at(s / margin);
        mass += weight;
        sum += weight * std::abs(y - s);
      }
    }
  }
  return 0.5 * period - sum / mass;
}

/// Values on the octant of an even function, half a period and its end along each axis, and their transform.
class Octant {
 public:
  explicit Octant(const std::array<int, 3>& period)
      : period_(period), half_{period[0] / 2 + 1, period[1] / 2 + 1, period[2] / 2 + 1} {
    values_.resize(static_cast<std::size_t>(half_[0]) * static_cast<std::size_t>(half_[1]) *
                   static_cast<std::size_t>(half_[2]));
  }

  int half(int axis) const { return half_[static_cast<std::size_t>(axis)]; }
  Complex& at(int x, int y, int z) {
    return values_[(static_cast<std::size_t>(x) * static_cast<std::size_t>(half_[1]) + static_cast<std::size_t>(y)) *
                       static_cast<std::size_t>(half_[2]) +
                   static_cast<std::size_t>(z)];
  }

  std::vector<Complex> values() && { return std::move(values_); }

  void transform() {
    for (int axis = 0; axis < 3; ++axis) {
      transform_along(axis);
    }
  }

 private:
  void transform_along(int axis) {
    constexpr int kLanes = kGridLanes<double>;
    const int n = period_[static_cast<std::size_t>(axis)];
    const LineTransform<double> line(n);
    const int others = static_cast<int>(values_.size()) / half(axis);
    const auto first = [&](int l) {  // of line l: a place, and the step along it
      const int inner = axis == 0 ? others : axis == 1 ? half(2) : 1;
      return std::pair(static_cast<std::size_t>(l / inner * inner * half(axis) + l % inner),
                       static_cast<std::size_t>(inner));
    };
#pragma omp parallel
    {
      std::vector<double> buffer(static_cast<std::size_t>(4 * n * kLanes));
      double* re = buffer.data();
      double* im = re + n * kLanes;
#pragma omp for schedule(static)
      for (int begin = 0; begin < others; begin += kLanes) {
        const int count = std::min(kLanes, others - begin);
        for (int l = 0; l < count; ++l) {
          const auto [place, step] = first(begin + l);
          for (int j = 0; j < n; ++j) {
            const Complex& value = values_[place + step * static_cast<std::size_t>(std::min(j, n - j))];
            re[j * kLanes + l] = value.real();
            im[j * kLanes + l] = value.imag();
          }
        }
        line.forward(re, im, im + n * kLanes);
        for (int l = 0; l < count; ++l) {
          const auto [place, step] = first(begin + l);
          for (int j = 0; j < half(axis); ++j) {
            values_[place + step * static_cast<std::size_t>(j)] = {re[j * kLanes + l], im[j * kLanes + l]};
          }
        }
      }
    }
  }

  std::array<int, 3> period_;
  std::array<int, 3> half_;
  std::vector<Complex> values_;
};

}  // namespace

template <typename Real>
LineTransform<Real>::LineTransform(int n) : n_(n), radices_(radices_of(n)) {
  for (int j = 0; j < n; ++j) {
    const double angle = 2.0 * std::numbers::pi * j / n;
    cos_.push_back(static_cast<Real>(std::cos(angle)));
    sin_.push_back(static_cast<Real>(std::sin(angle)));
  }
}

template <typename Real>
void LineTransform<Real>::run(Real* re, Real* im, Real* work) const {
  const LinePlan<Real> plan{n_, static_cast<int>(radices_.size()), radices_.data(), cos_.data(), sin_.data()};
  grid_loops_of<Real>().transform(plan, re, im, work, work + static_cast<std::ptrdiff_t>(n_) * kGridLanes<Real>);
}

template class LineTransform<float>;
template class LineTransform<double>;

double KaiserWindow::at(double s) const {
  const double t = 2.0 * s / width_;
  return std::abs(t) > 1.0 ? 0.0
                           : std::cyl_bessel_i(0.0, shape_ * std::sqrt(1.0 - t * t)) / std::cyl_bessel_i(0.0, shape_);
}

double KaiserWindow::transform(double xi) const {
  const Complex root = std::sqrt(Complex(shape_ * shape_ - 0.25 * width_ * width_ * xi * xi));
  const Complex ratio = std::abs(root) < 1e-6 ? 1.0 : std::sinh(root) / root;
  return width_ * ratio.real() / std::cyl_bessel_i(0.0, shape_);
}

template <typename Real>
std::vector<Real> KaiserWindow::polynomials() const {
  constexpr std::size_t kCount = kWindowDegree + 1;
  std::vector<Real> values(kCount * static_cast<std::size_t>(lanes()), Real(0));
  for (int l = 0; l < width_; ++l) {
    const std::array<double, kCount> c =
        powers<kCount, double>([&](double t) { return at(l + 1 - 0.5 * (t + 1.0) - 0.5 * width_); });
    for (std::size_t i = 0; i < kCount; ++i) {
      values[(kCount - 1 - i) * static_cast<std::size_t>(lanes()) + static_cast<std::size_t>(l)] =
          static_cast<Real>(c[i]);
    }
  }
  return values;
}

template std::vector<float> KaiserWindow::polynomials() const;
template std::vector<double> KaiserWindow::polynomials() const;

GridAxes grid_period(const GridSpec& spec, const Vector3& extent, const GridAxes& points) {
  GridAxes period{};
  for (std::size_t a = 0; a < 3; ++a) {
    const int cells = static_cast<int>(std::floor(extent(static_cast<Eigen::Index>(a)) / spec.step));
    period[a] = transform_size(std::max(2 * (cells + 1 + spec.margin), points[a]));
  }
  return period;
}

std::vector<Complex> grid_symbol(const KernelSplit& kernel, const GridSpec& spec, const Vector3& extent,
                                 const GridAxes& period) {
  Octant octant(period);
  const KaiserWindow window(spec.width, spec.window_shape);
  std::array<std::vector<double>, 3> place;   // along each axis [m]
  std::array<std::vector<double>, 3> factor;  // 1 / (P w^2)
  for (std::size_t a = 0; a < 3; ++a) {
    const int n = period[a];
    const double margin = 0.5 * n - extent(static_cast<Eigen::Index>(a)) / spec.step;
    for (int i = 0; i <= n / 2; ++i) {
      place[a].push_back(spec.step * continued(i, n, margin, spec.bend_shape * margin));
      factor[a].push_back(1.0 / (n * std::pow(window.transform(2.0 * std::numbers::pi * i / n), 2)));
    }
  }
  const auto at = [](const std::vector<double>& values, int i) { return values[static_cast<std::size_t>(i)]; };
  const auto for_each = [&octant](const auto& work) {
#pragma omp parallel for schedule(dynamic)
    for (int x = 0; x < octant.half(0); ++x) {
      for (int y = 0; y < octant.half(1); ++y) {
        for (int z = 0; z < octant.half(2); ++z) {
          work(octant.at(x, y, z), x, y, z);
        }
      }
    }
  };
  for_each([&](Complex& value, int x, int y, int z) {
    value = kernel.smooth(Vector3(at(place[0], x), at(place[1], y), at(place[2], z)).norm());
  });
  octant.transform();
  for_each(
      [&](Complex& value, int x, int y, int z) { value *= at(factor[0], x) * at(factor[1], y) * at(factor[2], z); });
  return std::move(octant).values();
}

template <typename Real>
GridConvolution<Real>::GridConvolution(const KernelSplit& kernel, const GridSpec& spec, const Vector3& extent) {
  constexpr int kLanes = kGridLanes<Real>;
  for (int axis = 0; axis < 3; ++axis) {
    const int cells = static_cast<int>(std::floor(extent(axis) / spec.step));
    // Rows along z are read and written by whole windows and whole rows of lanes.
    points_[static_cast<std::size_t>(axis)] =
        axis < 2 ? cells + spec.width : whole_rows(cells + KaiserWindow(spec.width, 0.0).lanes(), kLanes);
  }
  period_ = grid_period(spec, extent, points_);
  for (const int n : period_) {
    lines_.emplace_back(n);
  }
  symbol_row_ = whole_rows(period_[1], kLanes);
  make_symbol(kernel, spec, extent);
  re_.resize(static_cast<std::size_t>(points_[0] * plane()));
  im_.resize(re_.size());
  planes_re_.resize(static_cast<std::size_t>(period_[0] * plane()));
  planes_im_.resize(planes_re_.size());
}

template <typename Real>
void GridConvolution<Real>::make_symbol(const KernelSplit& kernel, const GridSpec& spec, const Vector3& extent) {
  const std::vector<Complex> symbol = grid_symbol(kernel, spec, extent, period_);
  const int half_x = period_[0] / 2 + 1;
  const int half_y = period_[1] / 2 + 1;
  const int half_z = period_[2] / 2 + 1;
  symbol_re_.resize(static_cast<std::size_t>(symbol_row_ * half_x * half_z));
  symbol_im_.resize(symbol_re_.size());
  for (int x = 0; x < half_x; ++x) {
    for (int z = 0; z < half_z; ++z) {
      const auto row = static_cast<std::size_t>(x * half_z + z) * static_cast<std::size_t>(symbol_row_);
      for (int y = 0; y < period_[1]; ++y) {
        const std::ptrdiff_t from =
            (static_cast<std::ptrdiff_t>(x) * half_y + std::min(y, period_[1] - y)) * half_z + z;
        const Complex& value = symbol[static_cast<std::size_t>(from)];
        symbol_re_[row + static_cast<std::size_t>(y)] = static_cast<Real>(value.real());
        symbol_im_[row + static_cast<std::size_t>(y)] = static_cast<Real>(value.imag());
      }
    }
  }
}

template <typename Real>
GridView<Real> GridConvolution<Real>::grid() {
  return {re_.data(), im_.data(), plane(), points_[2]};
}

template <typename Real>
void GridConvolution<Real>::clear() {
#pragma omp parallel for schedule(static)
  for (int x = 0; x < points_[0]; ++x) {
    std::fill_n(re_.begin() + x * plane(), plane(), Real(0));
    std::fill_n(im_.begin() + x * plane(), plane(), Real(0));
  }
}

template <typename Real>
void GridConvolution<Real>::multiply() {
  constexpr int kLanes = kGridLanes<Real>;
  const int longest = std::max(period_[0], static_cast<int>(whole_rows(std::max(period_[1], period_[2]), kLanes)));
  const auto line = static_cast<std::size_t>(longest * kLanes);
  const auto blocks = static_cast<int>(plane() / kLanes);
  const int reach = points_[0];
#pragma omp parallel
  {
    std::vector<Real> buffer(4 * line);
    std::vector<Real> columns(2 * static_cast<std::size_t>(symbol_row_ * points_[2]));
    Real* re = buffer.data();
    Real* im = re + line;
    Real* work = im + line;
    const auto along_x = [&](int b, std::vector<Real>& from_re, std::vector<Real>& from_im, int from, bool back,
                             std::vector<Real>& to_re, std::vector<Real>& to_im, int to) {
      for (int x = 0; x < from; ++x) {
        std::copy_n(from_re.begin() + x * plane() + b * kLanes, kLanes, re + x * kLanes);
        std::copy_n(from_im.begin() + x * plane() + b * kLanes, kLanes, im + x * kLanes);
      }
      std::fill(re + from * kLanes, re + period_[0] * kLanes, Real(0));
      std::fill(im + from * kLanes, im + period_[0] * kLanes, Real(0));
      back ? lines_[0].backward(re, im, work) : lines_[0].forward(re, im, work);
      for (int x = 0; x < to; ++x) {
        std::copy_n(re + x * kLanes, kLanes, to_re.begin() + x * plane() + b * kLanes);
        std::copy_n(im + x * kLanes, kLanes, to_im.begin() + x * plane() + b * kLanes);
      }
    };
#pragma omp for schedule(static)
    for (int b = 0; b < blocks; ++b) {
      along_x(b, re_, im_, reach, false, planes_re_, planes_im_, period_[0]);
    }
#pragma omp for schedule(static)
    for (int x = 0; x < period_[0]; ++x) {
      multiply_plane(x, columns.data(), buffer.data(), work);
    }
#pragma omp for schedule(static)
    for (int b = 0; b < blocks; ++b) {
      along_x(b, planes_re_, planes_im_, period_[0], true, re_, im_, reach);
    }
  }
}

/// Transforms a plane of what is transformed along x, multiplies by the symbol and transforms back.
template <typename Real>
void GridConvolution<Real>::multiply_plane(int x, Real* columns, Real* rows, Real* work) {
  constexpr int kLanes = kGridLanes<Real>;
  const std::ptrdiff_t column = symbol_row_ * kLanes;  // kLanes lines along y
  const int blocks = points_[2] / kLanes;
  const int rest = period_[1] - points_[1];
  Real* column_im = columns + blocks * column;
  for (int b = 0; b < blocks; ++b) {
    Real* re = columns + b * column;
    Real* im = column_im + b * column;
    for (int y = 0; y < points_[1]; ++y) {
      const std::ptrdiff_t from = x * plane() + static_cast<std::ptrdiff_t>(y) * points_[2] + b * kLanes;
      std::copy_n(planes_re_.begin() + from, kLanes, re + y * kLanes);
      std::copy_n(planes_im_.begin() + from, kLanes, im + y * kLanes);
    }
    std::fill_n(re + points_[1] * kLanes, rest * kLanes, Real(0));
    std::fill_n(im + points_[1] * kLanes, rest * kLanes, Real(0));
    lines_[1].forward(re, im, work);
  }
  Real* row_im = rows + (work - rows) / 2;
  const int folded_x = std::min(x, period_[0] - x);
  for (int y = 0; y < period_[1]; y += kLanes) {
    for (int z = 0; z < points_[2]; ++z) {
      const std::ptrdiff_t from = z / kLanes * column + y * kLanes + z % kLanes;
      for (int l = 0; l < kLanes; ++l) {
        rows[z * kLanes + l] = columns[from + l * kLanes];
        row_im[z * kLanes + l] = column_im[from + l * kLanes];
      }
    }
    std::fill(rows + points_[2] * kLanes, rows + period_[2] * kLanes, Real(0));
    std::fill(row_im + points_[2] * kLanes, row_im + period_[2] * kLanes, Real(0));
    lines_[2].forward(rows, row_im, work);
    for (int z = 0; z < period_[2]; ++z) {
      const std::ptrdiff_t from =
          (static_cast<std::ptrdiff_t>(folded_x) * (period_[2] / 2 + 1) + std::min(z, period_[2] - z)) * symbol_row_ +
          y;
      for (int l = 0; l < kLanes; ++l) {
        const Real re = rows[z * kLanes + l];
        const Real im = row_im[z * kLanes + l];
        const Real s_re = symbol_re_[static_cast<std::size_t>(from + l)];
        const Real s_im = symbol_im_[static_cast<std::size_t>(from + l)];
        rows[z * kLanes + l] = s_re * re - s_im * im;
        row_im[z * kLanes + l] = s_re * im + s_im * re;
      }
    }
    lines_[2].backward(rows, row_im, work);
    for (int z = 0; z < points_[2]; ++z) {
      const std::ptrdiff_t to = z / kLanes * column + y * kLanes + z % kLanes;
      for (int l = 0; l < kLanes; ++l) {
        columns[to + l * kLanes] = rows[z * kLanes + l];
        column_im[to + l * kLanes] = row_im[z * kLanes + l];
      }
    }
  }
  for (int b = 0; b < blocks; ++b) {
    Real* re = columns + b * column;
    Real* im = column_im + b * column;
    lines_[1].backward(re, im, work);
    for (int y = 0; y < points_[1]; ++y) {
      const std::ptrdiff_t to = x * plane() + static_cast<std::ptrdiff_t>(y) * points_[2] + b * kLanes;
      std::copy_n(re + y * kLanes, kLanes, planes_re_.begin() + to);
      std::copy_n(im + y * kLanes, kLanes, planes_im_.begin() + to);
    }
  }
}

template class GridConvolution<float>;
template class GridConvolution<double>;

}  // namespace touchfield
