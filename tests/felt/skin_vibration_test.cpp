#include "sim/felt/skin_vibration.h"

#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/felt/thresholds.h"

namespace touchfield {
namespace {

using Eigen::Index;

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kFinest = 1832;  // 2.5 k at 40 kHz [rad/m]

/// A sheet of right-angled triangles: `shape` puts a point of the plane somewhere.
template <class Shape>
TriangleMesh sheet(double edge, double reach, const Shape& shape) {
  const auto n = static_cast<int>(2.0 * reach / edge) | 1;
  Points points(3, (n + 1) * (n + 1));
  Triangles triangles(3, 2 * n * n);
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      points.col(i * (n + 1) + j) = shape(edge * (i - 0.5 * n), edge * (j - 0.5 * n));
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int a = i * (n + 1) + j;
      triangles.col(2 * (i * n + j)) << a, a + n + 1, a + 1;
      triangles.col(2 * (i * n + j) + 1) << a + n + 1, a + n + 2, a + 1;
    }
  }
  return {points, triangles};
}

TriangleMesh flat_sheet(double edge) {
  return sheet(edge, 14e-3, [](double x, double y) { return Vector3(x, y, 0.0); });
}

SkinPatch patch_of(const TriangleMesh& mesh) {
  Index face = 0;
  mesh.centroids().colwise().squaredNorm().minCoeff(&face);
  return skin_patch(mesh, face);
}

LayeredSkin half_space(double shear, double tan_delta = 0.4) {
  return {.layers = {{1.0, shear}}, .on_bone = false, .tan_delta = tan_delta};
}
LayeredSkin on_bone(double shear) { return {.layers = {{4e-3, shear}}, .on_bone = true}; }

/// A Gaussian spot at a place, on the faces.
Eigen::VectorXd spot(const SkinPatch& patch, const Eigen::Vector2d& at, double sigma) {
  return (-(patch.places.colwise() - at).colwise().squaredNorm().array() / (2.0 * sigma * sigma)).exp().transpose();
}

/// int G(k) f(k) k dk / (2 pi) of a spot of height 1.
template <class Function>
std::complex<double> hankel(double sigma, const Function& f) {
  constexpr int kSteps = 40'000;
  constexpr double kLast = 4000;
  std::complex<double> sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double k = kLast * (i + 0.5) / kSteps;
    sum += kTurn * sigma * sigma * std::exp(-0.5 * k * k * sigma * sigma) * k * f(k) * (kLast / kSteps) / kTurn;
  }
  return sum;
}

Eigen::ArrayXd all_wavenumbers() {
  constexpr int kSteps = 40'000;
  return 4000.0 / kSteps * (Eigen::ArrayXd::LinSpaced(kSteps, 0, kSteps - 1) + 0.5);
}

std::complex<double> hankel(double sigma, const Eigen::ArrayXcd& kernel, int order, double a, double r) {
  Index i = 0;
  return hankel(sigma, [&](double k) { return kernel(i++) * ::jn(order, k * a) * ::jn(order, k * r); });
}

TEST(PressureLines, HeldFramesGiveTheirSeries) {
  constexpr int kFrames = 24;
  Eigen::MatrixXd radiation(4, kFrames);
  const int lines[] = {1, 2, 5, 7};
  for (Index f = 0; f < 4; ++f) {
    for (int k = 0; k < kFrames; ++k) {
      radiation(f, k) = 3.0 + std::cos(kTurn * lines[f] * k / kFrames);
    }
  }
  const PressureLines found = frame_lines(radiation, 240.0, 100.0);
  ASSERT_EQ(found.hz, (std::vector<double>{10, 20, 50, 70}));
  for (Index f = 0; f < 4; ++f) {
    for (Index l = 0; l < 4; ++l) {
      const double turn = std::numbers::pi * lines[l] / kFrames;
      EXPECT_NEAR(std::abs(found.pressure(f, l)), f == l ? std::sin(turn) / turn : 0.0, 1e-12) << f << l;
    }
  }
}

TEST(PressureLines, ConstantFramesHaveNone) {
  EXPECT_TRUE(frame_lines(Eigen::MatrixXd::Constant(3, 10, 0.7), 100.0, 45.0).hz.empty());
  EXPECT_TRUE(frame_lines(Eigen::MatrixXd::Random(3, 10), 100.0, 5.0).hz.empty());
}

TEST(PressureLines, ModulatedSoundHasTwoLines) {
  const PressureLines lines = modulated_lines(Eigen::VectorXd::Constant(1, 8.0), 50.0);
  double square = 0.0;
  double mean = 0.0;
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps; ++i) {
    const double pressure = 8.0 * std::pow(0.5 + 0.5 * std::cos(kTurn * i / kSteps), 2);
    mean += pressure / kSteps;
    square += pressure * pressure / kSteps;
  }
  EXPECT_NEAR(lines.mean_square()(0), square - mean * mean, 1e-12);
}

struct SkinCase {
  const char* name;
  LayeredSkin skin;
};

class CirclingSpot : public ::testing::TestWithParam<SkinCase> {};

/// The lines of a spot that circles are Bessel functions (Jacobi and Anger): no grid, no period, no frames.
TEST_P(CirclingSpot, HasTheLinesOfJacobiAndAnger) {
  constexpr double kSigma = 2.5e-3;
  constexpr double kCircle = 3e-3;
  constexpr double kHz = 10;
  constexpr int kFrames = 120;
  const SkinPatch patch = patch_of(flat_sheet(0.7e-3));
  Eigen::MatrixXd radiation(patch.size(), kFrames);
  for (int k = 0; k < kFrames; ++k) {
    const double angle = kTurn * (k + 0.5) / kFrames;
    radiation.col(k) = spot(patch, kCircle * Eigen::Vector2d(std::cos(angle), std::sin(angle)), kSigma);
  }
  const PressureLines lines = frame_lines(radiation, kFrames * kHz, 60);
  ASSERT_EQ(lines.hz.size(), 6U);
  const Eigen::Vector2d at(4e-3, 0.0);
  const auto skin = skin_vibrations(patch, lines, {{"skin", GetParam().skin}}, kFinest, {at}).front();
  double largest = 0.0;
  for (const int n : {1, 2, 3, 4, 5}) {
    const Eigen::ArrayXcd kernel =
        skin_waves(GetParam().skin, kTurn * n * kHz, all_wavenumbers(), {0.0}).front().inwards;
    const double turn = std::numbers::pi * n / kFrames;
    const double expected = 2.0 * std::abs(hankel(kSigma, kernel, n, kCircle, at.norm())) * std::sin(turn) / turn;
    largest = std::max(largest, expected);
    EXPECT_NEAR(std::abs(skin.at_points(n - 1, 0)), expected, 0.01 * largest) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Skins, CirclingSpot,
                         ::testing::Values(SkinCase{"soft", half_space(10e3)}, SkinCase{"stiff", half_space(100e3)},
                                           SkinCase{"on_bone", on_bone(30e3)}),
                         [](const auto& test) { return test.param.name; });

/// The maps of a spot that is modulated, against integrals over k: displacement, velocity, strain energy.
TEST(SkinVibrations, MapsAreThoseOfTheHankelTransform) {
  constexpr double kSigma = 2.5e-3;
  const SkinPatch patch = patch_of(flat_sheet(0.5e-3));
  for (const LayeredSkin& layers : {half_space(30e3), on_bone(30e3)}) {
    const PressureLines lines{.hz = {100.0}, .pressure = spot(patch, Eigen::Vector2d::Zero(), kSigma)};
    const auto skin = skin_vibrations(patch, lines, {{"skin", layers}}, kFinest).front();
    const std::vector<SkinWaves> waves =
        skin_waves(layers, kTurn * 100.0, all_wavenumbers(), {0.0, kReceptorDepths[0], kReceptorDepths[2]});
    const Index middle = SkinVibration::kSide / 2;
    const double moved = std::abs(hankel(kSigma, waves[0].inwards, 0, 0.0, 0.0)) * std::numbers::sqrt2 / 2;
    EXPECT_NEAR(skin.displacement(middle, middle) / moved, 1.0, 3e-3);
    EXPECT_NEAR(skin.velocity(middle, middle) / (kTurn * 100.0 * moved), 1.0, 3e-3);
    EXPECT_NEAR(skin.displacement(middle + 8, middle), skin.displacement(middle, middle + 8), 3e-3 * moved);
    for (const auto& [depth, at] : {std::pair(0U, 1U), std::pair(2U, 2U)}) {  // on the axis e_xx = e_yy, no shear
      const double along = 0.5 * std::abs(hankel(kSigma, waves[at].e_xx, 0, 0.0, 0.0));
      const double inwards = std::abs(hankel(kSigma, waves[at].e_zz, 0, 0.0, 0.0));
      const double energy = 0.5 * waves[at].modulus * (2.0 * along * along + inwards * inwards);
      EXPECT_NEAR(skin.energy[depth](middle, middle) / energy, 1.0, 0.02) << depth;
    }
  }
}

TEST(SkinVibrations, WithoutMechanicsThePressureIsSeen) {
  const SkinPatch patch = patch_of(flat_sheet(0.5e-3));
  const auto skin =
      skin_vibrations(patch, modulated_lines(spot(patch, {2e-3, 0.0}, 2e-3), 100.0), {{"none", std::nullopt}}, kFinest)
          .front();
  EXPECT_NEAR(largest(skin.displacement), std::sqrt(0.5 * (0.25 + 1.0 / 64)), 0.01);
  EXPECT_NEAR(map_at(skin.displacement, {2e-3, 0.0}), largest(skin.displacement), 0.01);
  EXPECT_NEAR(half_area(skin.displacement), std::numbers::pi * 2.0 * std::log(2.0) * 4e-6, 1e-6);
  EXPECT_TRUE(std::isnan(skin.displacement(0, 0)));
}

TEST(FlatMaps, SpreadAndDip) {
  Eigen::MatrixXd map = Eigen::MatrixXd::Constant(SkinVibration::kSide, SkinVibration::kSide, 0.25);
  const Index middle = SkinVibration::kSide / 2;
  map.block(middle - 4, middle - 1, 3, 3).setOnes();
  map.block(middle + 2, middle - 1, 3, 3).setOnes();
  const Eigen::Vector2d away(1.5e-3, 0.0);
  EXPECT_DOUBLE_EQ(dip_between(map, -away, away), 0.25);
  EXPECT_DOUBLE_EQ(dip_between(map, -away, -away), 1.0);
  EXPECT_TRUE(std::isnan(dip_between(map, -away, {13e-3, 0.0})));
  EXPECT_NEAR(half_area(map), 18 * std::pow(SkinVibration::kStep, 2), 1e-12);
  map.row(0).setOnes();
  EXPECT_TRUE(std::isnan(half_area(map)));
}

struct BentCase {
  const char* name;
  double error;  // of lengths where a spot of sigma 2.5 mm presses
  double least;
  Vector3 (*shape)(double, double);
};

class BentSkin : public ::testing::TestWithParam<BentCase> {};

constexpr double kBend = 8e-3;  // a fingertip [m]

TEST_P(BentSkin, KeepsLengthsAsItSays) {
  const SkinPatch patch = patch_of(sheet(0.7e-3, 14e-3, GetParam().shape));
  EXPECT_NEAR(patch.places.colwise().norm().maxCoeff(), SkinPatch::kReach, 0.7e-3);
  EXPECT_EQ(patch.fade.minCoeff() >= 0.0 && patch.fade.maxCoeff() == 1.0, true);
  const double error = flattening_error(patch, spot(patch, Eigen::Vector2d::Zero(), 2.5e-3));
  EXPECT_LT(error, GetParam().error);
  EXPECT_GE(error, GetParam().least);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, BentSkin,
    ::testing::Values(BentCase{"plane", 1e-9, 0.0, [](double x, double y) { return Vector3(x, y, 0.0); }},
                      BentCase{"cylinder", 0.02, 0.0,
                               [](double x, double y) {
                                 return Vector3(kBend * std::sin(x / kBend), y, kBend * (std::cos(x / kBend) - 1.0));
                               }},
                      BentCase{"sphere", 0.05, 0.01,
                               [](double x, double y) {
                                 const double r = std::hypot(x, y);
                                 const double side = r > 0.0 ? kBend * std::sin(r / kBend) / r : 1.0;
                                 return Vector3(side * x, side * y, kBend * (std::cos(r / kBend) - 1.0));
                               }}),
    [](const auto& test) { return test.param.name; });

double octave_above(TouchChannel channel, double hz) {
  return relative_threshold(channel, 2.0 * hz).value() - relative_threshold(channel, hz).value();
}

TEST(RelativeThreshold, HasThePublishedSlopesAndBest) {
  EXPECT_NEAR(octave_above(TouchChannel::kPacinian, 40.0), -12.0, 1e-9);
  EXPECT_NEAR(octave_above(TouchChannel::kPacinian, 125.0), -12.0, 1e-9);
  EXPECT_NEAR(octave_above(TouchChannel::kPacinian, 250.0), 9.0, 1e-9);
  EXPECT_NEAR(octave_above(TouchChannel::kRapidlyAdapting, 20.0), 0.0, 1e-9);
  EXPECT_EQ(relative_threshold(TouchChannel::kPacinian, 250.0), 0.0);
}

TEST(RelativeThreshold, IsNotExtrapolated) {
  for (const double hz : {1.0, 9.9, 40.1, 250.0}) {
    EXPECT_FALSE(relative_threshold(TouchChannel::kRapidlyAdapting, hz)) << hz;
  }
  for (const double hz : {10.0, 39.9, 500.1}) {
    EXPECT_FALSE(relative_threshold(TouchChannel::kPacinian, hz)) << hz;
  }
  EXPECT_THROW(relative_threshold(TouchChannel::kPacinian, 0.0), InputError);
}

}  // namespace
}  // namespace touchfield
