#include "sim/acoustics/incident_field.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/acoustics/transducer_array.h"

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

constexpr double kGain = 0.83;
constexpr double kPhase = 0.7;

ChannelResponse known_response(Eigen::Index channels) {
  return {Eigen::VectorXd::Constant(channels, kGain), Eigen::VectorXd::Constant(channels, kPhase)};
}

TransducerArray pair_of(const Directivity& directivity) {
  return make_array(grid_layout(2, 1, 10e-3), directivity, 0.9, kAutd3SourceStrength);
}

// p = g exp(i phase) level P0 d(theta) exp(i k r) / r of the second transducer, by hand.
TEST(ChannelResponse, AKnownChannelGivesTheAnalyticPressureOfOneTransducer) {
  Medium medium = air(293.15);
  for (const double absorption : {0.0, 0.15}) {
    medium.absorption = absorption;
    const Wave wave(medium, 40e3);
    for (const Directivity& directivity :
         {Directivity::omni(), Directivity::piston(wave.k(), 4.5e-3), Directivity::t4010a1()}) {
      TransducerArray array = pair_of(directivity);
      array.response = known_response(2);
      array.response.gain(0) = 0.0;  // dead: the other alone is heard
      const Vector3 x(35e-3, -20e-3, 150e-3);
      const Vector3 offset = x - array.positions.col(1);
      const double r = offset.norm();
      const Complex expected = kGain *
                               std::polar(0.9 * kAutd3SourceStrength * directivity.value(offset.z() / r) / r, kPhase) *
                               std::exp(Complex(0, 1) * wave.wavenumber() * r);
      const Eigen::MatrixXcd g = incident_matrix(array, wave, Points(x));
      EXPECT_EQ(g(0, 0), Complex(0.0));
      EXPECT_LT(std::abs(g(0, 1) - expected), 1e-12 * std::abs(expected));
      const Complex drive = std::polar(1.0, -0.3);
      const Eigen::MatrixXcd p = incident_pressure(array, wave, Points(x), Eigen::Vector2cd(1.0, drive));
      EXPECT_LT(std::abs(p(0, 0) - drive * expected), 1e-12 * std::abs(expected));
    }
  }
}

TEST(ChannelResponse, DerivativesAndPlaneWavesHaveItToo) {
  const Wave wave(air(293.15), 40e3);
  const Points x = Vector3(35e-3, -20e-3, 150e-3);
  const Points along = Vector3(0.6, 0.0, 0.8);
  const Complex factor = std::polar(kGain, kPhase);
  for (TransducerArray array : {pair_of(Directivity::t4010a1()), plane_wave(Vector3::UnitZ(), 3.0)}) {
    const Eigen::VectorXcd drive = Eigen::VectorXcd::Constant(array.size(), Complex(0.4, 0.8));
    const Eigen::MatrixXcd slope = incident_derivative_matrix(array, wave, x, along);
    const Eigen::MatrixXcd driven = incident_derivative(array, wave, x, along, drive);
    array.response = known_response(array.size());
    EXPECT_LT((incident_derivative_matrix(array, wave, x, along) - factor * slope).norm(), 1e-14 * slope.norm());
    EXPECT_LT((incident_derivative(array, wave, x, along, drive) - factor * driven).norm(), 1e-14 * driven.norm());
  }
}

TEST(RandomResponse, HasTheMeansAndDeviationsAskedFor) {
  constexpr Eigen::Index kChannels = 40000;
  const ChannelResponse drawn = random_response(kChannels, {.phase = 0.2, .gain = 0.1, .dead = 0.05}, 3);
  const auto n = static_cast<double>(kChannels);
  const auto alive = (drawn.gain.array() > 0).cast<double>().eval();
  EXPECT_NEAR(alive.sum() / n, 0.95, 4 * std::sqrt(0.05 * 0.95 / n));
  const double mean = drawn.gain.sum() / alive.sum();
  EXPECT_NEAR(mean, 1.0, 4 * 0.1 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt((alive * (drawn.gain.array() - mean).square()).sum() / alive.sum()), 0.1, 0.002);
  EXPECT_NEAR(drawn.phase.mean(), 0.0, 4 * 0.2 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(drawn.phase.squaredNorm() / n), 0.2, 0.004);
  EXPECT_NEAR(((drawn.gain.array() - 1) * alive * drawn.phase.array()).mean(), 0.0, 4 * 0.1 * 0.2 / std::sqrt(n));
}

// A sweep over tolerances compares an array with the same one made worse.
TEST(RandomResponse, AChannelsNumbersDependOnTheSeedAndItsPlaceAlone) {
  const ChannelResponse one = random_response(100, {.phase = 0.1, .gain = 0.02, .dead = 0.1}, 5);
  const ChannelResponse worse = random_response(300, {.phase = 0.3, .gain = 0.06, .dead = 0.2}, 5);
  const ChannelResponse other = random_response(100, {.phase = 0.1, .gain = 0.02, .dead = 0.1}, 6);
  for (Eigen::Index n = 0; n < 100; ++n) {
    EXPECT_NEAR(worse.phase(n), 3 * one.phase(n), 1e-15);
    if (one.gain(n) == 0) {
      EXPECT_EQ(worse.gain(n), 0.0);
    } else if (worse.gain(n) > 0) {
      EXPECT_NEAR(worse.gain(n) - 1, 3 * (one.gain(n) - 1), 1e-15);
    }
  }
  EXPECT_GT((one.phase - other.phase).norm(), 0.1);
}

}  // namespace touchfield::incident_field_test
