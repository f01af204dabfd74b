#include <cmath>
#include <numbers>

#include "sim/acoustics/transducer_array.h"
#include "sim/core/units.h"
#include "tests/support/testing.h"

namespace touchfield::directivity_test {

constexpr double kPi = std::numbers::pi;

TEST(Directivity, T4010a1PassesThroughItsTable) {
  const double table[] = {1,           1,           1,           0.891250938, 0.707945784,
                          0.501187234, 0.354813389, 0.251188643, 0.199526231, 0.177827941};
  const Directivity d = Directivity::t4010a1();
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(d.at(10.0 * i * kDegree).value, table[i], 1e-14) << 10 * i << " degrees";
    EXPECT_NEAR(d.at(kPi - 10.0 * i * kDegree).value, table[i], 1e-14) << "mirrored " << 10 * i << " degrees";
  }
}

TEST(Directivity, T4010a1IsANaturalSpline) {
  const Directivity d = Directivity::t4010a1();
  constexpr double kStep = 1e-4;
  const auto curvature = [&](double theta) {
    return (d.at(theta + kStep).slope - d.at(theta - kStep).slope) / (2 * kStep);
  };
  for (int i = 1; i < 9; ++i) {
    const double node = 10.0 * i * kDegree;
    // Slope and curvature continue across the nodes; the third derivative, below 100 here, may jump.
    EXPECT_NEAR(d.at(node - 1e-9).slope, d.at(node + 1e-9).slope, 1e-6);
    EXPECT_NEAR(curvature(node - 1.1 * kStep), curvature(node + 1.1 * kStep), 100 * 2.2 * kStep);
  }
  // Natural: no curvature at the ends.
  EXPECT_NEAR(curvature(2 * kStep), 0.0, 100 * 2 * kStep);
  EXPECT_NEAR(curvature(0.5 * kPi - 2 * kStep), 0.0, 100 * 2 * kStep);
}

TEST(Directivity, SlopesEqualCentralDifferences) {
  constexpr double kStep = 1e-6;
  for (const Directivity& d : {Directivity::omni(), Directivity::piston(732.28, 4.5e-3), Directivity::t4010a1()}) {
    for (double theta = 0.03; theta < kPi; theta += 0.1) {
      const double difference = (d.at(theta + kStep).value - d.at(theta - kStep).value) / (2 * kStep);
      EXPECT_NEAR(d.at(theta).slope, difference, 1e-8) << "theta " << theta;
    }
  }
}

TEST(Directivity, PistonHasItsFirstZeroWhereJ1Has) {
  constexpr double kFirstZero = 3.831705970207512;  // of J1
  const double k = 732.28;
  const double radius = 8e-3;
  const Directivity d = Directivity::piston(k, radius);
  EXPECT_NEAR(d.at(std::asin(kFirstZero / (k * radius))).value, 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(d.value(1.0), 1.0);
  // Series and Bessel function meet: 1 - x^2/8 + x^4/192.
  const double x = 1e-3;
  EXPECT_NEAR(Directivity::piston(1.0, 1.0).at(std::asin(x)).value, 1 - x * x / 8, x * x * x * x);
  EXPECT_THROW(Directivity::piston(732.0, 0.0), InputError);
}

TEST(Directivity, ClampsCosinesThatRoundingPushedBeyondOne) {
  EXPECT_DOUBLE_EQ(Directivity::t4010a1().value(1.0 + 1e-15), 1.0);
  EXPECT_NEAR(Directivity::t4010a1().value(-1.0 - 1e-15), 1.0, 1e-14);
}

}  // namespace touchfield::directivity_test
