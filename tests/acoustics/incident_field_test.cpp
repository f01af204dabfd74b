#include "sim/acoustics/incident_field.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/core/units.h"

namespace touchfield::incident_field_test {

Wave wave_at(double frequency, double absorption = 0.0) {
  Medium medium = air(293.15);
  medium.absorption = absorption;
  return {medium, frequency};
}

TransducerArray one_transducer(const Directivity& directivity, double level = 1.0) {
  return make_array(grid_layout(1, 1, 0.01), directivity, level, kAutd3SourceStrength);
}

TEST(IncidentField, AnElementByHand) {
  // 30 mm beside and 40 mm above a transducer: r = 50 mm, theta = atan(3/4) = 36.870 degrees.
  const Wave wave = wave_at(40e3);
  const Directivity directivity = Directivity::t4010a1();
  const Points x = Vector3(0.03, 0.0, 0.04);
  const std::complex<double> g = incident_matrix(one_transducer(directivity, 0.5), wave, x)(0, 0);
  const double k = 2.0 * std::numbers::pi * 40e3 / 343.21;
  const double magnitude = 0.5 * 4.386 * directivity.at(std::atan2(3.0, 4.0)).value / 0.05;
  EXPECT_NEAR(g.real(), magnitude * std::cos(k * 0.05), 1e-12 * magnitude);
  EXPECT_NEAR(g.imag(), magnitude * std::sin(k * 0.05), 1e-12 * magnitude);
}

TEST(IncidentField, OnAxisPressureAtThirtyCentimetres) {
  const Points x = Vector3(0, 0, 0.3);
  EXPECT_NEAR(std::abs(incident_matrix(one_transducer(Directivity::t4010a1()), wave_at(40e3), x)(0, 0)), 14.62, 0.005);
}

TEST(IncidentField, DerivativeEqualsCentralDifferences) {
  const Wave wave = wave_at(40e3, 0.152);
  Points x(3, 3);
  x << 0.02, -0.05, 0.001,  //
      0.01, 0.03, 0.08,     //
      0.06, 0.10, -0.05;
  Points direction(3, 3);
  direction << 1, 0, 0.6,  //
      0, 0.8, 0,           //
      0, 0.6, 0.8;
  constexpr double kStep = 1e-6;  // (k h)^2 / 6 = 1e-7
  const TransducerArray arrays[] = {one_transducer(Directivity::omni()),
                                    one_transducer(Directivity::piston(wave.k(), 4.5e-3)),
                                    one_transducer(Directivity::t4010a1()), plane_wave(Vector3(0.6, 0, 0.8), 2.0)};
  for (const TransducerArray& array : arrays) {
    const Eigen::MatrixXcd derivative = incident_derivative_matrix(array, wave, x, direction);
    const Eigen::MatrixXcd difference =
        (incident_matrix(array, wave, x + kStep * direction) - incident_matrix(array, wave, x - kStep * direction)) /
        (2 * kStep);
    EXPECT_LT((derivative - difference).norm(), 1e-6 * difference.norm());
  }
}

TEST(IncidentField, OnTheAxisTheDerivativeIsTheRadialOne) {
  const Wave wave = wave_at(40e3);
  const Points x = Vector3(0, 0, 0.2);
  const TransducerArray array = one_transducer(Directivity::t4010a1());
  const std::complex<double> p = incident_matrix(array, wave, x)(0, 0);
  const std::complex<double> along = incident_derivative_matrix(array, wave, x, Vector3::UnitZ())(0, 0);
  EXPECT_LT(std::abs(along - std::complex<double>(-1 / 0.2, wave.k()) * p), 1e-12 * std::abs(along));
  EXPECT_LT(std::abs(incident_derivative_matrix(array, wave, x, Vector3::UnitX())(0, 0)), 1e-12 * std::abs(along));
}

TEST(IncidentField, AbsorptionDampsByItsExponential) {
  const Points x = Vector3(0, 0, 0.4);
  const TransducerArray array = one_transducer(Directivity::omni());
  const double ratio = std::abs(incident_matrix(array, wave_at(40e3, 0.152), x)(0, 0)) /
                       std::abs(incident_matrix(array, wave_at(40e3), x)(0, 0));
  EXPECT_NEAR(ratio, std::exp(-0.152 * 0.4), 1e-14);
}

TEST(IncidentField, OmniSourcesAreReciprocal) {
  const Vector3 a(0.01, 0.02, 0.03);
  const Vector3 b(-0.04, 0.07, 0.2);
  ArrayLayout at_a = grid_layout(1, 1, 0.01);
  ArrayLayout at_b = at_a;
  at_a.positions = a;
  at_b.positions = b;
  const Wave wave = wave_at(40e3);
  EXPECT_EQ(incident_matrix(make_array(at_a, Directivity::omni(), 1, 1), wave, b),
            incident_matrix(make_array(at_b, Directivity::omni(), 1, 1), wave, a));
}

TEST(IncidentField, PressureOfADrivenArrayIsGTimesQ) {
  const Wave wave = wave_at(40e3);
  const TransducerArray array = make_array(grid_layout(6, 5, 0.01), Directivity::t4010a1(), 1, 4.386);
  std::srand(1);
  const Points x = (0.05 * Points::Random(3, 40)).colwise() + Vector3(0, 0, 0.1);
  const Eigen::MatrixXcd q = Eigen::MatrixXcd::Random(30, 3);
  const Eigen::MatrixXcd expected = incident_matrix(array, wave, x) * q;
  EXPECT_LT((incident_pressure(array, wave, x, q) - expected).norm(), 1e-13 * expected.norm());
  EXPECT_LT((incident_pressure(array, wave, x, q, true) - expected).norm(), 1e-6 * expected.norm());
}

}  // namespace touchfield::incident_field_test
