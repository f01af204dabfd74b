#include "sim/field/held_signal.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace touchfield {

std::vector<SpectralLine> lines_of_held(const Eigen::VectorXd& values, double rate, double highest) {
  const auto count = static_cast<double>(values.size());
  std::vector<SpectralLine> lines;
  for (int m = 1; m * rate / count <= highest; ++m) {
    const double turn = std::numbers::pi * m / count;
    // By the remainder of m k, which is exact, so that long signals lose no digits.
    std::complex<double> sum = 0.0;
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      const Eigen::Index step = static_cast<Eigen::Index>(m) * k % values.size();
      sum += values(k) * std::polar(1.0, -2.0 * std::numbers::pi * static_cast<double>(step) / count);
    }
    const double magnitude = std::abs(sum) / count * std::abs(std::sin(turn) / turn);
    lines.push_back({m * rate / count, 2.0 * magnitude * magnitude});
  }
  return lines;
}

double mean_square_in(const std::vector<SpectralLine>& lines, const FrequencyBand& band) {
  double sum = 0.0;
  for (const SpectralLine& line : lines) {
    sum += line.hz >= band.low && line.hz < band.high ? line.mean_square : 0.0;
  }
  return sum;
}

}  // namespace touchfield
