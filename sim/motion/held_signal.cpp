#include <cmath>

#include "sim/felt/skin_vibration.h"
#include "sim/motion/pattern.h"

namespace touchfield {

std::vector<SpectralLine> lines_of_held(const Eigen::VectorXd& values, double rate, double highest) {
  constexpr double kHair = 1e-9;  // a line on the edge of a bin begins it
  const double spacing = rate / static_cast<double>(values.size());
  const Eigen::RowVectorXcd series = held_lines(values.transpose(), rate, highest);
  std::vector<SpectralLine> lines;
  for (Eigen::Index line = 0; line < series.size(); ++line) {
    const double hz = static_cast<double>(line + 1) * spacing;
    const double square = 0.5 * std::norm(series(line));
    if (spacing * kBinsPerHz >= 1.0) {
      lines.push_back({hz, square, spacing});
      continue;
    }
    const double low = std::floor(hz * kBinsPerHz + kHair) / kBinsPerHz;
    if (lines.empty() || lines.back().hz < low) {
      lines.push_back({low, 0.0, 1.0 / kBinsPerHz});
    }
    lines.back().mean_square += square;
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

Eigen::MatrixXcd rung_up(const Eigen::MatrixXcd& drives, double frame, double ring_up) {
  const double half = std::exp(-0.5 * frame / ring_up);
  const double whole = half * half;
  // What a pass from silence leaves, of which a steady state has a geometric series.
  Eigen::VectorXcd before = Eigen::VectorXcd::Zero(drives.rows());
  for (const auto& q : drives.colwise()) {
    before = q + whole * (before - q);
  }
  before /= 1.0 - std::pow(whole, static_cast<double>(drives.cols()));
  Eigen::MatrixXcd emitted(drives.rows(), drives.cols());
  for (Eigen::Index k = 0; k < drives.cols(); ++k) {
    emitted.col(k) = drives.col(k) + half * (before - drives.col(k));
    before = drives.col(k) + whole * (before - drives.col(k));
  }
  return emitted;
}

}  // namespace touchfield
