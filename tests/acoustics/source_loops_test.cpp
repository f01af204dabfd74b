#include "sim/acoustics/source_loops.h"

#include <array>
#include <cmath>
#include <complex>
#include <random>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/acoustics/transducer_array.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield::source_loops_test {

constexpr double kWavenumber = 732.0;  // [rad/m]

/// Random transducers and what they make of a point, by the definition.
struct Scene {
  std::vector<double> x, y, z, axis_x, axis_y, axis_z, amplitude;
  std::vector<std::complex<double>> expected;
  std::vector<std::complex<double>> expected_slope;
  Vector3 point;
  Vector3 direction;

  Scene(int count, const Directivity& directivity, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    point = 0.1 * Vector3(uniform(random), uniform(random), uniform(random));
    direction = Vector3(uniform(random), uniform(random), uniform(random)).normalized();
    for (int n = 0; n < count; ++n) {
      const Vector3 place = 0.3 * Vector3(uniform(random), uniform(random), uniform(random));
      Vector3 axis = Vector3(uniform(random), uniform(random), uniform(random)).normalized();
      if (n == 0) axis = (point - place).normalized();
      if (n == 1) axis = (place - point).normalized();
      if (n == 2) axis = (point - place).unitOrthogonal();
      const Vector3 offset = point - place;
      const double r = offset.norm();
      const double theta = std::atan2(axis.cross(offset).norm(), axis.dot(offset));
      const double d = directivity.at(theta).value;
      const Vector3 radial = offset / r;
      const double turn = n < 2 ? 0.0 : (std::cos(theta) * radial - axis).dot(direction) / (r * std::sin(theta));
      x.push_back(place.x());
      y.push_back(place.y());
      z.push_back(place.z());
      axis_x.push_back(axis.x());
      axis_y.push_back(axis.y());
      axis_z.push_back(axis.z());
      amplitude.push_back(1.0 + uniform(random) * 0.5);
      expected.push_back(std::polar(amplitude.back() * d / r, kWavenumber * r));
      expected_slope.push_back(std::polar(amplitude.back() / r, kWavenumber * r) *
                               (std::complex<double>(-1.0 / r, kWavenumber) * radial.dot(direction) * d +
                                directivity.at(theta).slope * turn));
    }
  }
};

// Counts that fill no, one and several registers, and a rest.
constexpr int kCounts[] = {1, 3, 8, 17, 249};

template <typename Real>
class SourceValuesOf : public ::testing::Test {};

using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(SourceValuesOf, Reals);

TYPED_TEST(SourceValuesOf, AgreeWithTheDefinitionInEveryLevel) {
  using Real = TypeParam;
  constexpr bool kSingle = std::is_same_v<Real, float>;
  const auto rounded = [](const auto& of) { return std::vector<Real>(of.begin(), of.end()); };
  for (const Directivity& directivity : {Directivity::omni(), Directivity::t4010a1()}) {
    const double* nodes = directivity.spline();
    const std::vector<Real> spline(nodes, nodes == nullptr ? nullptr : nodes + 4 * Directivity::kIntervals);
    const SourceWave<Real> wave{Real(kWavenumber), spline.empty() ? nullptr : spline.data(), Directivity::kIntervals,
                                Real(Directivity::kInterval)};
    for (const InstructionLevel level : processor_levels()) {
      const auto& loops = source_loops(level);
      const auto loop = [&](const Real* point, const Real* direction, const SourceArrays<Real>& arrays, int count,
                            std::complex<Real>* values) {
        auto* numbers = reinterpret_cast<Real*>(values);
        if constexpr (kSingle) {
          loops.single(wave, point, direction, arrays, count, numbers);
        } else {
          loops.exact(wave, point, direction, arrays, count, numbers);
        }
      };
      for (const int count : kCounts) {
        const Scene scene(count, directivity, static_cast<unsigned>(count));
        const std::array parts = {rounded(scene.x),        rounded(scene.y),      rounded(scene.z),
                                  rounded(scene.axis_x),   rounded(scene.axis_y), rounded(scene.axis_z),
                                  rounded(scene.amplitude)};
        const SourceArrays<Real> arrays{parts[0].data(), parts[1].data(), parts[2].data(), parts[3].data(),
                                        parts[4].data(), parts[5].data(), parts[6].data()};
        const std::vector<Real> point = rounded(scene.point);
        const std::vector<Real> direction = rounded(scene.direction);
        std::vector<std::complex<Real>> values(static_cast<std::size_t>(count));
        std::vector<std::complex<Real>> slopes(values.size());
        loop(point.data(), nullptr, arrays, count, values.data());
        loop(point.data(), direction.data(), arrays, count, slopes.data());
        for (std::size_t n = 0; n < values.size(); ++n) {
          // The first two are on the axis, where the cosine holds the angle to 2e-8 only, in single precision to 3e-4;
          // k r is some 400, of which a float holds 3e-5.
          const double tolerance = kSingle ? 2e-4 : n < 2 ? 2e-8 : 1e-12;
          const double size = std::abs(scene.expected[n]);
          EXPECT_LT(std::abs(Complex(values[n]) - scene.expected[n]), tolerance * size)
              << to_string(level) << ", " << n << " of " << count;
          EXPECT_LT(std::abs(Complex(slopes[n]) - scene.expected_slope[n]),
                    (kSingle ? 2.0 : 1.0) * tolerance * kWavenumber * size)
              << "slope, " << to_string(level) << ", " << n << " of " << count;
        }
      }
    }
  }
}

TEST(SourceValues, AreWhatIncidentPressureSums) {
  const Directivity directivity = Directivity::t4010a1();
  const TransducerArray array = make_array(grid_layout(7, 5, 0.01), directivity, 0.5, kAutd3SourceStrength);
  const Wave wave(air(kRoomTemperature), 40e3);
  Points points(3, 70);  // more than two panels
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    points.col(j) << 0.001 * static_cast<double>(j), -0.02, 0.1 + 0.002 * static_cast<double>(j);
  }
  const Eigen::MatrixXcd drive = Eigen::MatrixXcd::Random(array.size(), 3);
  const Eigen::MatrixXcd g = incident_matrix(array, wave, points);
  EXPECT_LT((incident_pressure(array, wave, points, drive) - g * drive).norm(), 1e-13 * (g * drive).norm());
  EXPECT_LT((incident_pressure(array, wave, points, drive, true) - g * drive).norm(),
            1e-6 * (g.cwiseAbs() * drive.cwiseAbs()).norm());
  EXPECT_LT((incident_matrix_single(array, wave, points).cast<Complex>() - g).cwiseAbs().maxCoeff(),
            1e-4 * g.cwiseAbs().maxCoeff());
  const Points up = Points::Zero(3, points.cols()).colwise() + Vector3(0.6, 0.0, 0.8);
  const Eigen::MatrixXcd slope = incident_derivative_matrix(array, wave, points, up);
  EXPECT_LT((incident_derivative_matrix_single(array, wave, points, up).cast<Complex>() - slope).cwiseAbs().maxCoeff(),
            1e-4 * slope.cwiseAbs().maxCoeff());
  const TransducerArray piston =
      make_array(grid_layout(7, 5, 0.01), Directivity::piston(wave.k(), 4.5e-3), 0.5, kAutd3SourceStrength);
  const Eigen::MatrixXcd one_by_one = incident_matrix(piston, wave, points);  // by no loop
  EXPECT_LT((incident_matrix_single(piston, wave, points).cast<Complex>() - one_by_one).norm(),
            1e-6 * one_by_one.norm());
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    for (Eigen::Index n = 0; n < array.size(); ++n) {
      const Vector3 offset = points.col(j) - array.positions.col(n);
      const double theta = std::acos(offset.z() / offset.norm());
      const Complex expected =
          std::polar(array.amplitudes(n) * directivity.at(theta).value / offset.norm(), wave.k() * offset.norm());
      EXPECT_LT(std::abs(g(j, n) - expected), 1e-12 * std::abs(expected));
    }
  }
}

}  // namespace touchfield::source_loops_test
