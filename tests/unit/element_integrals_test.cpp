#include "sim/bem/element_integrals.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "sim/bem/kernel.h"

namespace touchfield {
namespace {

constexpr double kPi = std::numbers::pi;

Face make_face(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 twice = (b - a).cross(c - a);
  return {a, b, c, twice.normalized(), 0.5 * twice.norm()};
}

Face scalene() { return make_face({0.1e-3, -0.2e-3, 0.3e-3}, {2.9e-3, 0.4e-3, 0.1e-3}, {0.8e-3, 2.2e-3, -0.4e-3}); }

/// Tanh-sinh nodes and weights on 0..1: converges past the near-singular spikes that defeat polynomial rules.
struct Rule {
  std::vector<double> x;
  std::vector<double> w;
};

Rule tanh_sinh() {
  Rule rule;
  constexpr double kStep = 1.0 / 32.0;
  for (int i = -110; i <= 110; ++i) {
    const double t = i * kStep;
    const double u = 0.5 * kPi * std::sinh(t);
    rule.x.push_back(0.5 * (1.0 + std::tanh(u)));
    rule.w.push_back(0.5 * kStep * 0.5 * kPi * std::cosh(t) / (std::cosh(u) * std::cosh(u)));
  }
  return rule;
}

/// The integral over the face split at the foot of x into three triangles with the foot as common corner, where the
/// spike sits in a corner of the Duffy square and tanh-sinh resolves it. The foot must lie inside the face.
Complex reference_integral(const Face& face, const Vector3& x, const Complex& wavenumber) {
  const Vector3 foot = x - face.normal.dot(x - face.a) * face.normal;
  const Rule rule = tanh_sinh();
  Complex sum = 0;
  const Vector3 corners[] = {face.a, face.b, face.c};
  for (int e = 0; e < 3; ++e) {
    const Vector3 b = corners[e];
    const Vector3 c = corners[(e + 1) % 3];
    const double twice_area = face.normal.dot((b - foot).cross(c - foot));
    for (std::size_t i = 0; i < rule.x.size(); ++i) {
      for (std::size_t j = 0; j < rule.x.size(); ++j) {
        const Vector3 y = foot + rule.x[i] * ((b - foot) + rule.x[j] * (c - b));
        const Vector3 offset = x - y;
        if (offset.norm() > 0) {
          sum += rule.w[i] * rule.w[j] * rule.x[i] * twice_area * double_layer_kernel(offset, face.normal, wavenumber);
        }
      }
    }
  }
  return sum;
}

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
      const Complex expected = reference_integral(face, x, {k, 0.152});
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
