#include "sim/body/random_field.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace touchfield {

namespace {

constexpr Eigen::Index kWaves = 1024;

/// A point of the plane with two independent normal coordinates, in polar form.
class NormalPairs {
 public:
  struct Polar {
    double radius;
    double angle;  // [rad]

    double first() const { return radius * std::cos(angle); }
    double second() const { return radius * std::sin(angle); }
  };

  explicit NormalPairs(std::uint64_t seed) : bits_(seed) {}

  Polar next() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return {radius, 2.0 * std::numbers::pi * uniform()};
  }

 private:
  /// Uniform in 0 < u <= 1.
  double uniform() {
    constexpr int kDigits = std::numeric_limits<double>::digits;
    return std::ldexp(static_cast<double>((bits_() >> (64 - kDigits)) + 1), -kDigits);
  }

  std::mt19937_64 bits_;
};

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
