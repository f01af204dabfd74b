#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

namespace touchfield {

/// Coefficients of the filter's polynomial (SurfaceFilter): Chebyshev's on [0, largest] of
///
///   f(l) = 2 / (1 + c sqrt(1 - l / k_e^2)),   k_e = k (1 + 0.1 i)
///
/// wavenumber   k + i alpha [1/m]
/// coupling     c > 0
/// largest      eigenvalue of the Laplacian [1/m2]
inline std::vector<std::complex<double>> filter_coefficients(const std::complex<double>& wavenumber, double coupling,
                                                             double largest) {
  constexpr double kDamping = 0.1;  // of k_e; 0.02 to 0.3 take as many steps
  constexpr int kSamples = 200;     // of f
  constexpr int kLargestDegree = 16;
  constexpr double kHalfTurn = 3.14159265358979323846;
  const double ratio = std::sqrt(largest) / wavenumber.real();
  const int degree = std::min(kLargestDegree, static_cast<int>(std::ceil(4.0 + 0.5 * ratio)));
  const std::complex<double> effective = wavenumber * std::complex<double>(1.0, kDamping);
  std::vector<std::complex<double>> coefficients(static_cast<std::size_t>(degree) + 1);
  for (int q = 0; q < kSamples; ++q) {
    const double angle = (q + 0.5) * kHalfTurn / kSamples;
    const double l = 0.5 * (std::cos(angle) + 1.0) * largest;
    const std::complex<double> value = 2.0 / (1.0 + coupling * std::sqrt(1.0 - l / (effective * effective)));
    for (int j = 0; j <= degree; ++j) {
      coefficients[static_cast<std::size_t>(j)] += (j == 0 ? 1.0 : 2.0) / kSamples * std::cos(j * angle) * value;
    }
  }
  return coefficients;
}

}  // namespace touchfield
