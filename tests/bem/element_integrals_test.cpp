#include "sim/bem/element_integrals.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/support/reference_integrals.h"

namespace touchfield {
namespace {

constexpr double kPi = std::numbers::pi;

Face scalene() { return make_face({0.1e-3, -0.2e-3, 0.3e-3}, {2.9e-3, 0.4e-3, 0.1e-3}, {0.8e-3, 2.2e-3, -0.4e-3}); }

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

TEST(ElementIntegrals, NearIntegralAgainstTanhSinh) {
  const Face face = scalene();
  const double edge = (face.b - face.a).norm();
  const Vector3 above = (0.5 * face.a + 0.2 * face.b + 0.3 * face.c);
  for (const double k : {732.28, 1281.5}) {  // 40 and 70 kHz: the face is a third and 0.6 of a wavelength
    for (const double height : {2.0, 1.0, 0.25, 0.05, 0.01, -0.05, -1.0}) {
      const Vector3 x = above + height * edge * face.normal;
      const Complex expected = reference_integral(face, x, [&](const Vector3& y) {
        return double_layer_kernel(x - y, face.normal, {k, 0.152});
      });
      const Complex value = double_layer_integral(face, x, {k, 0.152});
      EXPECT_LT(std::abs(value - expected), 1e-6 * std::abs(expected)) << "height " << height << " edges, k " << k;
    }
  }
}

TEST(ElementIntegrals, FarAwayItIsTheKernelTimesTheArea) {
  const Face face = scalene();
  const Vector3 centroid = (face.a + face.b + face.c) / 3.0;
  const Vector3 x = centroid + 0.2 * Vector3(1, 1, 3).normalized();
  const Complex k(20.0, 0.0);  // far below a wavelength, so that only the distance matters: (1.5 mm / 200 mm)^2 = 6e-5
  const Complex expected = face.area * double_layer_kernel(x - centroid, face.normal, k);
  EXPECT_LT(std::abs(double_layer_integral(face, x, k) - expected), 1e-4 * std::abs(expected));
}

TEST(ElementIntegrals, DoesNotChangeUnderARigidMotionOrACornerShift) {
  const Face face = scalene();
  const Vector3 x = face.a + Vector3(1e-3, 0.5e-3, 1e-3);
  const Complex k(732.28, 0);
  const Complex value = double_layer_integral(face, x, k);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  const Vector3 shift(0.1, -0.2, 0.05);
  const auto moved = [&](const Vector3& v) -> Vector3 { return turn * v + shift; };
  const Complex same = double_layer_integral(make_face(moved(face.a), moved(face.b), moved(face.c)), moved(x), k);
  EXPECT_LT(std::abs(same - value), 1e-10 * std::abs(value));  // coordinates of 0.2 m keep 1e-13 of a millimetre
  const Complex shifted = double_layer_integral(make_face(face.b, face.c, face.a), x, k);
  EXPECT_LT(std::abs(shifted - value), 1e-12 * std::abs(value));
}

}  // namespace
}  // namespace touchfield
