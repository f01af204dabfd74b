#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/bem/grid_spec.h"

namespace touchfield::kernel_split_test {

constexpr double kReach = 5e-3;
constexpr double kShape = 11.0;

class KernelSplits : public ::testing::TestWithParam<Complex> {};

double power_sum(const double* c, double t) {
  double sum = 0;
  for (int i = kLocalDegree<double>; i >= 0; --i) {
    sum = sum * t + c[i];
  }
  return sum;
}

// Both parts together are the kernel: 4 pi r g = v + 4 pi r (chi * g).
TEST_P(KernelSplits, PartsAddUp) {
  const Complex kappa = GetParam();
  const KernelSplit split(kappa, kReach, kShape);
  const LocalKernel<double> local = split.local<double>(0.0);
  for (const double u : {0.01, 0.1, 0.37, 0.5, 0.8, 0.99, 1.0}) {
    const double r = u * kReach;
    const double t = 2.0 * u - 1.0;
    const Complex v(power_sum(local.re.v, t), power_sum(local.im.v, t));
    const Complex whole = std::exp(Complex(0, 1) * kappa * r);
    EXPECT_LT(std::abs(v + 4.0 * std::numbers::pi * r * split.smooth(r) - whole), 1e-9) << u;
  }
  EXPECT_EQ(local.damped, kappa.imag() != 0.0);
}

// The mean value property: the smooth part runs into the kernel at the reach, with its slope.
TEST_P(KernelSplits, TheLocalPartEndsSmoothly) {
  const KernelSplit split(GetParam(), kReach, kShape);
  const LocalKernel<double> local = split.local<double>(0.0);
  EXPECT_NEAR(power_sum(local.re.v, 1.0), 0.0, 1e-10);
  EXPECT_NEAR(power_sum(local.re.a, 1.0), 0.0, 1e-10);
  EXPECT_NEAR(power_sum(local.re.v, -1.0), 1.0, 1e-10);  // 1/r where r is 0
  EXPECT_NEAR(power_sum(local.re.a, -1.0), 1.0, 1e-10);
  EXPECT_NEAR(power_sum(local.re.b, -1.0), 3.0, 1e-10);
}

// a = v - r v', b = r^2 v'' - 3 r v' + 3 v by differences of v.
TEST_P(KernelSplits, SlopesAreThoseOfTheValue) {
  const KernelSplit split(GetParam(), kReach, kShape);
  const LocalKernel<double> local = split.local<double>(0.0);
  constexpr double kStep = 1e-4;
  for (const double u : {0.2, 0.5, 0.9}) {
    const auto v = [&](double at) { return power_sum(local.re.v, 2.0 * at - 1.0); };
    const double first = (v(u + kStep) - v(u - kStep)) / (2.0 * kStep);
    const double second = (v(u + kStep) - 2.0 * v(u) + v(u - kStep)) / (kStep * kStep);
    EXPECT_NEAR(power_sum(local.re.a, 2.0 * u - 1.0), v(u) - u * first, 1e-6);
    EXPECT_NEAR(power_sum(local.re.b, 2.0 * u - 1.0), u * u * second - 3.0 * u * first + 3.0 * v(u), 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Wavenumbers, KernelSplits,
                         ::testing::Values(Complex(732.28, 0.0), Complex(732.28, 30.0), Complex(0.0, 0.0)));

}  // namespace touchfield::kernel_split_test
