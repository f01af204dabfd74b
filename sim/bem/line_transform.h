#pragma once

#include <vector>

#include "sim/bem/grid_loops.h"

namespace touchfield {

/// The smallest even number from n on without a prime factor above 5.
int transform_size(int n);

/// Discrete Fourier transforms of kGridLanes lines at once, number j of line l at [j kGridLanes + l]:
///
///   X_m = sum over j of x_j exp(-+ 2 pi i j m / n)
///
/// n          without a prime factor above 5
/// accuracy   a few roundings of the largest value
/// source     Stockham's order of Cooley and Tukey's stages: Van Loan, Computational Frameworks for the Fast Fourier
///            Transform (1992), ch. 1.7
template <typename Real>
class LineTransform {
 public:
  explicit LineTransform(int n);

  int size() const { return n_; }
  /// work   as long as re and im together
  void forward(Real* re, Real* im, Real* work) const { run(re, im, work); }
  void backward(Real* re, Real* im, Real* work) const { run(im, re, work); }

 private:
  void run(Real* re, Real* im, Real* work) const;

  int n_;
  std::vector<int> radices_;
  std::vector<Real> cos_, sin_;
};

extern template class LineTransform<float>;
extern template class LineTransform<double>;

}  // namespace touchfield
