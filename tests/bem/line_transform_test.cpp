#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "sim/bem/grid_convolution.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield::line_transform_test {

template <typename Real>
class LineTransforms : public ::testing::Test {
 public:
  static constexpr double kTolerance = std::is_same_v<Real, float> ? 1e-6 : 1e-14;
};

using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(LineTransforms, Reals);

TEST(TransformSize, IsEvenWithoutALargePrimeFactor) {
  EXPECT_EQ(transform_size(2), 2);
  EXPECT_EQ(transform_size(7), 8);
  EXPECT_EQ(transform_size(13), 16);
  EXPECT_EQ(transform_size(27), 30);
  EXPECT_EQ(transform_size(97), 100);
}

TYPED_TEST(LineTransforms, AreTheSumsTheyStandFor) {
  constexpr int kLanes = kGridLanes<TypeParam>;
  for (const int n : {2, 4, 6, 8, 10, 24, 30, 32, 36, 50, 90, 128, 150}) {  // each radix alone and after others
    const LineTransform<TypeParam> line(n);
    std::vector<TypeParam> re(static_cast<std::size_t>(n * kLanes));
    std::vector<TypeParam> im(re.size());
    std::vector<TypeParam> work(2 * re.size());
    for (std::size_t i = 0; i < re.size(); ++i) {
      re[i] = static_cast<TypeParam>(static_cast<double>(i * 37 % 101) / 101.0 - 0.5);
      im[i] = static_cast<TypeParam>(static_cast<double>(i * 53 % 97) / 97.0 - 0.5);
    }
    const std::vector<TypeParam> x_re = re;
    const std::vector<TypeParam> x_im = im;
    line.forward(re.data(), im.data(), work.data());
    for (const int l : {0, kLanes - 1}) {
      for (int m = 0; m < n; ++m) {
        std::complex<double> sum = 0;
        for (int j = 0; j < n; ++j) {
          const auto at = static_cast<std::size_t>(j * kLanes + l);
          sum += std::complex<double>(x_re[at], x_im[at]) * std::polar(1.0, -2.0 * std::numbers::pi * j * m / n);
        }
        const auto at = static_cast<std::size_t>(m * kLanes + l);
        EXPECT_LT(std::abs(std::complex<double>(re[at], im[at]) - sum), TestFixture::kTolerance * n) << n << ' ' << m;
      }
    }
    line.backward(re.data(), im.data(), work.data());
    for (std::size_t i = 0; i < re.size(); ++i) {
      EXPECT_NEAR(re[i] / static_cast<TypeParam>(n), x_re[i], TestFixture::kTolerance);
      EXPECT_NEAR(im[i] / static_cast<TypeParam>(n), x_im[i], TestFixture::kTolerance);
    }
  }
}

}  // namespace touchfield::line_transform_test
