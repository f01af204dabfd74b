#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "sim/bem/quadrature.h"
#include "tests/support/reference_integrals.h"

namespace touchfield::element_integrals_test {

constexpr double kPi = std::numbers::pi;

TEST(ElementIntegrals, KernelIsTheNormalDerivativeOfG) {
  const Complex k(732.28, 0.152);
  const Vector3 x(0.01, 0.02, -0.005);
  const Vector3 y(0.004, -0.003, 0.001);
  const Vector3 n = Vector3(1, 2, -2) / 3.0;
  const auto g = [&](const Vector3& at) {
    const double r = (x - at).norm();
    return std::exp(Complex(0, 1) * k * r) / (4.0 * kPi * r);
  };
  constexpr double kStep = 1e-7;
  const Complex difference = (g(y + kStep * n) - g(y - kStep * n)) / (2 * kStep);
  const Complex kernel = double_layer_kernel(x - y, n, k);
  EXPECT_LT(std::abs(kernel - difference), 1e-6 * std::abs(kernel));
  EXPECT_NEAR(double_layer_kernel(x - y, n, 1e-9).real(), static_double_layer_kernel(x - y, n), 1e-9);
}

TEST(ElementIntegrals, SolidAngleOfAnOctantAndItsSigns) {
  // The face through the unit points of the axes is seen from the origin as one eighth of the sphere.
  const Face octant = make_face({1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(solid_angle(octant, Vector3::Zero()), -4.0 * kPi / 8.0, 1e-14);  // behind the normal
  const Vector3 mirrored = Vector3::Constant(2.0 / 3.0);
  EXPECT_NEAR(solid_angle(octant, mirrored), 4.0 * kPi / 8.0, 1e-14);
  // Just above an inner point the face fills half the sphere.
  const Vector3 middle = Vector3::Constant(1.0 / 3.0);
  EXPECT_NEAR(solid_angle(octant, middle + 1e-9 * octant.normal), 2.0 * kPi, 1e-7);
  EXPECT_NEAR(solid_angle(octant, middle - 1e-9 * octant.normal), -2.0 * kPi, 1e-7);
  // In the plane but outside: nothing.
  EXPECT_NEAR(solid_angle(octant, Vector3(3, -1, -1)), 0.0, 1e-14);
}

}  // namespace touchfield::element_integrals_test
