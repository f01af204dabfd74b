#include "sim/core/sincos.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace touchfield::sincos_test {

TEST(SinCos, AgreesWithLongDoubleOverItsRange) {
  std::mt19937_64 generator(1);
  for (const double range : {1e-8, 1.0, 10.0, 1e3, 1e5}) {
    std::uniform_real_distribution<double> draw(-range, range);
    for (int i = 0; i < 20000; ++i) {
      const double x = draw(generator);
      const SinCos value = sincos(x);
      const double tolerance = 4e-16 * (1.0 + std::abs(x) / 1e5);
      ASSERT_NEAR(value.sin, static_cast<double>(std::sin(static_cast<long double>(x))), tolerance) << "x " << x;
      ASSERT_NEAR(value.cos, static_cast<double>(std::cos(static_cast<long double>(x))), tolerance) << "x " << x;
    }
  }
}

}  // namespace touchfield::sincos_test
