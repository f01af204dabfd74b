#include "sim/bem/line_transform.h"

#include <cmath>
#include <numbers>

namespace touchfield {

namespace {

std::vector<int> radices_of(int n) {
  std::vector<int> radices;
  for (const int radix : {5, 3, 4, 2}) {
    for (; n % radix == 0; n /= radix) {
      radices.push_back(radix);
    }
  }
  if (n != 1) {
    radices.clear();
  }
  return radices;
}

}  // namespace

int transform_size(int n) {
  n += n % 2;
  while (radices_of(n).empty()) {
    n += 2;
  }
  return n;
}

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

}  // namespace touchfield
