#include "sim/hand/random_field.h"

#include <cmath>

#include "sim/core/normal_pairs.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kWaves = 1024;

}  // namespace

RandomField::RandomField(double rms, double correlation, std::uint64_t seed)
    : wavevectors_(3, kWaves), phases_(kWaves), amplitudes_(kWaves) {
  NormalPairs normal(seed);
  const double scale = rms / std::sqrt(static_cast<double>(kWaves));
  for (Eigen::Index m = 0; m < kWaves; ++m) {
    const NormalPairs::Polar across = normal.next();
    const NormalPairs::Polar along = normal.next();
    const NormalPairs::Polar wave = normal.next();
    wavevectors_.col(m) = Vector3(across.first(), across.second(), along.first()) / correlation;
    amplitudes_(m) = scale * wave.radius;
    phases_(m) = wave.angle;
  }
}

Eigen::VectorXd RandomField::at(const Points& points) const {
  Eigen::VectorXd values(points.cols());
#pragma omp parallel for schedule(static) if (points.cols() > 512)
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3 x = points.col(i);
    double sum = 0;
    for (Eigen::Index m = 0; m < kWaves; ++m) {
      sum += amplitudes_(m) * std::cos(wavevectors_.col(m).dot(x) + phases_(m));
    }
    values(i) = sum;
  }
  return values;
}

}  // namespace touchfield
