#include "sim/felt/skin_response.h"

#include <cmath>
#include <numbers>

#include "tests/support/testing.h"

namespace touchfield::skin_response_test {

LayeredSkin half_space(double tan_delta) {
  return {.layers = {{.thickness = 0.0, .shear = 20e3}}, .tan_delta = tan_delta};
}

TEST(SkinWaves, OfSlowPressureAreThoseOfBoussinesq) {
  const LayeredSkin skin = half_space(0.0);
  const Eigen::ArrayXd k = Eigen::ArrayXd::LinSpaced(3, 50.0, 5000.0);
  const std::vector<SkinWaves> waves = skin_waves(skin, std::numbers::pi, k, {0.0, 0.002});
  EXPECT_LT((2.0 * waves[0].modulus * k * waves[0].inwards - 1.0).abs().maxCoeff(), 2e-4);
}

}  // namespace touchfield::skin_response_test
