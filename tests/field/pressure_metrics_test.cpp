#include <cmath>
#include <limits>
#include <string>

#include "sim/core/rigid_motion.h"
#include "sim/field/metrics.h"
#include "tests/support/mesh_support.h"
#include "tests/support/output_support.h"
#include "tests/support/sphere_support.h"
#include "tests/support/testing.h"

namespace touchfield::pressure_metrics_test {

/// A flat strip of skin facing down (-z), x from -20 to 20 mm and y from -5 to 5 mm, squares of 0.5 mm cut in two.
TriangleMesh strip() { return shifted(sheet(80, 20, 0.5e-3), {0, 0, -0.2}); }

TargetBox box_of_8mm() { return {{0, 0, 0}, {8e-3, 4e-3, 2e-3}}; }

Target target_on(const TriangleMesh& mesh) { return make_target(mesh, {box_of_8mm()}, TargetProfile::kUniform, 100.0); }

TEST(PressureMetrics, AScaledCopyOfTheTargetHasNoErrorLeft) {
  const TriangleMesh mesh = strip();
  const Target target = target_on(mesh);
  Eigen::VectorXcd p = Eigen::VectorXcd::Zero(mesh.face_count());
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    p(target.faces[i]) = std::polar(50.0, 0.1 * static_cast<double>(i));  // half of what is wanted, any phase
  }
  const Metrics m = metrics_of(mesh, wave(), {box_of_8mm()}, target, p);
  EXPECT_NEAR(m.relative_error, 0.0, 1e-12);
  EXPECT_NEAR(m.relative_error_raw, 0.5, 1e-12);
  EXPECT_NEAR(m.scale, 2.0, 1e-12);
  EXPECT_NEAR(m.correlation, 1.0, 1e-12);
  EXPECT_NEAR(m.leakage, 0.0, 1e-12);
  EXPECT_NEAR(m.mean_inside_pa, 50.0, 1e-10);
  EXPECT_NEAR(m.cv_inside, 0.0, 1e-6);  // the root of a difference of equal squares
  EXPECT_DOUBLE_EQ(m.peak_pa, 50.0);
  EXPECT_NEAR(m.width_wanted_mm, 8.0, 1e-9);
  EXPECT_NEAR(m.length_wanted_mm, 4.0, 1e-9);
}

TEST(PressureMetrics, ErrorAndCorrelationAreOneTriangle) {
  const TriangleMesh mesh = strip();
  const Target target = target_on(mesh);
  std::srand(1);
  const Eigen::VectorXcd p = 100.0 * Eigen::VectorXcd::Random(mesh.face_count());
  const Metrics m = metrics_of(mesh, wave(), {box_of_8mm()}, target, p);
  EXPECT_NEAR(m.relative_error * m.relative_error, 1.0 - m.correlation * m.correlation, 1e-12);
  // A global phase and a global level change nothing that is relative.
  const Metrics same = metrics_of(mesh, wave(), {box_of_8mm()}, target, std::polar(3.0, 0.7) * p);
  EXPECT_NEAR(same.relative_error, m.relative_error, 1e-12);
  EXPECT_NEAR(same.leakage, m.leakage, 1e-12);
  EXPECT_NEAR(same.width_mm, m.width_mm, 1e-9);
}

TEST(PressureMetrics, UniformPressureLeaksTheShareOfTheAreaOutside) {
  const TriangleMesh mesh = strip();
  const Target target = target_on(mesh);
  const Eigen::VectorXcd p = Eigen::VectorXcd::Constant(mesh.face_count(), 10.0);
  const Metrics m = metrics_of(mesh, wave(), {box_of_8mm()}, target, p);
  EXPECT_NEAR(m.leakage, 1.0 - 8.0 * 4.0 / 400.0, 1e-12);
  // || p' ||^2 - <p, p'>^2 / || p ||^2 over || p' ||^2 = 1 - share of the area
  EXPECT_NEAR(m.relative_error, std::sqrt(1.0 - 0.08), 1e-12);
  EXPECT_TRUE(std::isnan(m.width_mm));  // it falls to half nowhere
}

TEST(PressureMetrics, WidthStopsAtTheFirstCrossingAndIgnoresSkinThatFacesAway) {
  const TriangleMesh mesh = strip();
  const auto p = at_centroids(mesh, [](const Vector3& at) {
    const double x = std::abs(at.x());
    return x < 3e-3 ? 1.0 : (x > 8e-3 && x < 12e-3 ? 0.9 : 0.0);  // a peak of 6 mm and side lobes that do not join it
  });
  const Target target = target_on(mesh);
  // The bins at the edge fall from 1 to 0 between centres 2.875 and 3.125 mm: half at 3.
  EXPECT_NEAR(half_maximum_width(mesh, box_of_8mm(), target, p.cwiseAbs2()), 6e-3, 0.01e-3);

  // A second sheet that faces up, loud everywhere, must not count.
  const TriangleMesh turned(mesh.vertices(), mesh.triangles().colwise().reverse());
  const TriangleMesh both = together(mesh, shifted(turned, {0, 0, 10e-3}));
  Eigen::VectorXcd loud(2 * p.size());
  loud << p, Eigen::VectorXcd::Constant(p.size(), 5.0);
  EXPECT_NEAR(half_maximum_width(both, box_of_8mm(), target_on(both), loud.cwiseAbs2()), 6e-3, 0.01e-3);
}

TEST(PressureMetrics, WidthFollowsARotatedBox) {
  const TriangleMesh mesh = strip();
  const auto p = at_centroids(mesh, [](const Vector3& x) { return std::abs(x.x()) < 3e-3 ? 1.0 : 0.0; });
  const Eigen::Matrix3d turn = extrinsic_rotation({0.4, 0.2, -0.9});
  TargetBox box = box_of_8mm();
  box.rotation = turn;
  const TriangleMesh turned = transformed(mesh, turn, Vector3::Zero());
  const Target target = make_target(turned, {box}, TargetProfile::kUniform, 1.0);
  EXPECT_NEAR(half_maximum_width(turned, box, target, p.cwiseAbs2()), 6e-3, 0.01e-3);
}

TEST(RadiationPressure, OfUniformPressureIsTheWorkedValue) {
  const TriangleMesh mesh = strip();
  const Eigen::VectorXcd p = Eigen::VectorXcd::Constant(mesh.face_count(), Complex(0, 1000.0));
  const Metrics m = metrics_of(mesh, wave(), {box_of_8mm()}, target_on(mesh), p);
  // 1e6 Pa2 / (4 rho c^2) = 1.7626 Pa, on 32 mm2 and on the other 368 mm2.
  const double radiation = 1e6 / (4.0 * 1.2041 * 343.21 * 343.21);
  EXPECT_NEAR(m.force_target_n, radiation * 32e-6, 1e-12);
  EXPECT_NEAR(m.force_elsewhere_n, radiation * 368e-6, 1e-12);
  const Metrics without = metrics_of(mesh, p, Eigen::VectorXd::Constant(p.size(), radiation));
  EXPECT_NEAR(without.force_elsewhere_n, radiation * 400e-6, 1e-12);
  EXPECT_NEAR(without.abs_force_elsewhere_n, radiation * 400e-6, 1e-12);
  EXPECT_TRUE(std::isnan(without.relative_error));
}

/// Metrics of a radiation pressure by its place on the strip.
Metrics metrics_of_radiation(const TriangleMesh& mesh, const auto& radiation_at) {
  return metrics_of(mesh, {box_of_8mm()}, target_on(mesh), Eigen::VectorXcd::Ones(mesh.face_count()),
                    at_centroids(mesh, radiation_at).real());
}

bool is_in_box(const Vector3& x) { return std::abs(x.x()) < 4e-3 && std::abs(x.y()) < 2e-3; }

TEST(RadiationMetrics, AScaledCopyOfTheWantedRadiationHasNoErrorLeft) {
  const Metrics m = metrics_of_radiation(strip(), [](const Vector3& x) { return is_in_box(x) ? 3.0 : 0.0; });
  EXPECT_NEAR(m.relative_error_radiation, 0.0, 1e-12);
  EXPECT_NEAR(m.abs_force_elsewhere_n, 0.0, 1e-15);
  EXPECT_EQ(m.loudest_elsewhere, 0.0);
}

TEST(RadiationMetrics, WidthAndLengthOfAPlateauAreItsSides) {
  const auto plateau = [](const Vector3& x) { return std::abs(x.x()) < 3e-3 && std::abs(x.y()) < 1.5e-3 ? 2.0 : 0.0; };
  const Metrics m = metrics_of_radiation(strip(), plateau);
  EXPECT_NEAR(m.width_radiation_mm, 6.0, 0.01);
  EXPECT_NEAR(m.length_radiation_mm, 3.0, 0.01);
  const Metrics endless = metrics_of_radiation(strip(), [](const Vector3& x) { return std::abs(x.x()) < 3e-3; });
  EXPECT_NEAR(endless.width_radiation_mm, 6.0, 0.01);
  EXPECT_TRUE(std::isnan(endless.length_radiation_mm));
}

TEST(RadiationMetrics, SuctionCountsAsLoadButNotAsTheWantedOne) {
  // 1 on the target (32 mm2), -1 on twice its area beside it: a P - P' is smallest at a = 1/3.
  const auto beside = [](const Vector3& x) { return std::abs(x.x()) > 6e-3 && std::abs(x.x()) < 14e-3; };
  const auto at = [&](const Vector3& x) {
    return is_in_box(x) ? 1.0 : beside(x) && std::abs(x.y()) < 2e-3 ? -1.0 : 0.0;
  };
  const Metrics m = metrics_of_radiation(strip(), at);
  EXPECT_NEAR(m.abs_force_elsewhere_n, 64e-6, 1e-15);
  EXPECT_NEAR(m.relative_error_radiation, std::sqrt(2.0 / 3.0), 1e-12);
  EXPECT_NEAR(m.force_elsewhere_n, -64e-6, 1e-15);

  // What sucks on the target is no copy of a push at any level, and has no width.
  const Metrics sucked = metrics_of_radiation(strip(), [](const Vector3& x) { return is_in_box(x) ? -1.0 : 0.0; });
  EXPECT_EQ(sucked.relative_error_radiation, 1.0);
  EXPECT_TRUE(std::isnan(sucked.width_radiation_mm) && std::isnan(sucked.loudest_elsewhere));
}

TEST(RadiationMetrics, LoudestElsewhereIsOfFacesWithoutAPartInTheTarget) {
  // The box ends at x = 4.1 mm, inside squares that are louder than all others.
  const TriangleMesh mesh = strip();
  TargetBox box = box_of_8mm();
  box.size.x() = 8.2e-3;
  const Target target = make_target(mesh, {box}, TargetProfile::kUniform, 100.0);
  const auto radiation_at = [](const Vector3& x) {
    if (std::abs(x.x()) > 4.5e-3) {
      return x.x() > 0 ? 0.5 : -3.0;
    }
    return is_in_box(x) ? 2.0 : std::abs(x.y()) < 2e-3 ? 9.0 : 0.0;
  };
  const Metrics m = metrics_of(mesh, {box}, target, Eigen::VectorXcd::Ones(mesh.face_count()),
                               at_centroids(mesh, radiation_at).real());
  const double inside = (2.0 * 32.0 + 9.0 * 0.8) / 32.8;
  EXPECT_NEAR(m.loudest_elsewhere, 0.5 / inside, 1e-9);
  EXPECT_NEAR(m.abs_force_elsewhere_n, (9.0 * 3.2 + 0.5 * 155.0 + 3.0 * 155.0) * 1e-6, 1e-12);
}

/// "70 75 75 105", in the order of the table.
std::string levels_at(double frequency) {
  std::string text;
  for (const ExposureLimit& limit : exposure_limits(frequency)) {
    text += (text.empty() ? "" : " ") + std::to_string(std::lround(limit.level));
  }
  return text;
}

TEST(SoundLevel, IsOfTheRootMeanSquare) {
  EXPECT_NEAR(sound_level(std::sqrt(2.0)), 93.979, 1e-3);  // 1 Pa rms
  EXPECT_NEAR(sound_level(20e-6 * std::sqrt(2.0)), 0.0, 1e-12);
  EXPECT_NEAR(sound_level(2.0) - sound_level(1.0), 6.0206, 1e-4);
  EXPECT_EQ(sound_level(0.0), -std::numeric_limits<double>::infinity());
}

TEST(ExposureLimits, AreThoseOfTheThirdOctaveBand) {
  EXPECT_EQ(levels_at(20e3), "70 75 75 105");
  EXPECT_EQ(levels_at(25e3), "100 110 110 110");
  EXPECT_EQ(levels_at(40e3), "100 110 110 115");
  EXPECT_EQ(levels_at(63e3), "100 110 115");  // Health Canada ends with 50 kHz
  EXPECT_EQ(levels_at(100e3), "100 110 115");
  // Bands meet at 10^(n + 1/2)/10 Hz.
  EXPECT_EQ(levels_at(22.3e3), levels_at(20e3));
  EXPECT_EQ(levels_at(22.5e3), levels_at(25e3));
  EXPECT_EQ(levels_at(56.1e3), levels_at(50e3));
  EXPECT_EQ(levels_at(56.3e3), levels_at(63e3));
}

TEST(ExposureLimits, AreNotGivenWhereNobodyGivesThem) {
  for (const double frequency : {1e3, 17.7e3, 112.3e3, 200e3, 0.0, -1.0, std::nan("")}) {
    EXPECT_TRUE(exposure_limits(frequency).empty()) << frequency;
  }
}

}  // namespace touchfield::pressure_metrics_test
