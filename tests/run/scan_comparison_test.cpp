#include "sim/run/scan_comparison.h"

#include <numbers>
#include <random>

#include <nlohmann/json.hpp>

#include "sim/run/evaluate_methods.h"
#include "sim/run/solve_model.h"
#include "sim/run/text_table.h"
#include "tests/support/files.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::scan_comparison_test {

using RunData = touchfield::Run;

struct Solved {
  Model model;
  RunData run;

  explicit Solved(const std::vector<std::string>& changes = {})
      : model(small_model(changes)), run(solve_model(model)) {}

  /// What a microphone would read on a grid below the body, in its own scale, turned, with noise.
  MeasuredPoints scan(std::size_t method, const Complex& factor, double noise, bool complex) const {
    MeasuredPoints measured;
    measured.complex = complex;
    measured.points.resize(3, 100);
    for (Eigen::Index j = 0; j < 100; ++j) {
      const auto column = static_cast<double>(j % 10);
      const auto row = static_cast<double>(j / 10);
      measured.points.col(j) = 1e-3 * Vector3(3 * column - 13.5, 2.0, 3 * row + 10);
      measured.lines.push_back(static_cast<int>(j) + 2);
    }
    measured.pressure =
        factor * run_field(run, model.fixed->wave, measured.points).pressure.col(static_cast<Eigen::Index>(method));
    std::mt19937_64 bits(5);
    std::normal_distribution<double> normal;
    const double rms = measured.pressure.norm() / 10;
    for (Complex& p : measured.pressure) {
      p += noise * rms * std::numbers::sqrt2 / 2 * Complex(normal(bits), normal(bits));
      p = complex ? p : Complex(std::abs(p));
    }
    return measured;
  }
};

const Solved& solved() {
  static const Solved kSolved;
  return kSolved;
}

TEST(ScanComparison, FindsScaleAndPhaseOfACleanScan) {
  const Complex factor = std::polar(0.013, -2.1);
  for (const bool complex : {true, false}) {
    const MeasuredPoints measured = solved().scan(1, factor, 0.0, complex);
    const ScanComparison found = compare_scan(solved().run, solved().model.fixed->wave, "unscattered", measured);
    EXPECT_EQ(found.used, 100U);
    EXPECT_NEAR(found.fit.scale, 0.013, 1e-12);
    EXPECT_LT(found.fit.relative, 1e-10);
    EXPECT_NEAR(found.fit.correlation, 1.0, 1e-12);
    EXPECT_LT(found.largest_relative, 1e-10);
    if (complex) {
      EXPECT_NEAR(found.fit.turn, -2.1, 1e-10);
      EXPECT_LT(found.conjugate_correlation, 0.9);
    } else {
      EXPECT_TRUE(std::isnan(found.fit.turn));
    }
  }
}

TEST(ScanComparison, FindsThemThroughNoiseAndSaysHowMuchIsLeft) {
  const double noise = 0.05;
  const MeasuredPoints complex = solved().scan(0, std::polar(2.0, 0.7), noise, true);
  const ScanComparison found = compare_scan(solved().run, solved().model.fixed->wave, "paper", complex);
  EXPECT_NEAR(found.fit.scale, 2.0, 2.0 * 0.02);
  EXPECT_NEAR(found.fit.turn, 0.7, 0.02);
  EXPECT_NEAR(found.fit.relative, noise, 0.01);
  EXPECT_NEAR(found.fit.relative, std::sqrt(1 - std::pow(found.fit.correlation, 2)), 1e-10);
  const MeasuredPoints magnitudes = solved().scan(0, std::polar(2.0, 0.7), noise, false);
  const ScanComparison plain = compare_scan(solved().run, solved().model.fixed->wave, "paper", magnitudes);
  EXPECT_NEAR(plain.fit.scale, 2.0, 2.0 * 0.02);
  EXPECT_NEAR(plain.fit.relative, noise / std::numbers::sqrt2, 0.01);  // a magnitude has the half along the pressure
}

TEST(ScanComparison, TheOtherTimeFactorIsNoticed) {
  MeasuredPoints measured = solved().scan(0, 1.0, 0.01, true);
  measured.pressure = measured.pressure.conjugate().eval();
  const ScanComparison found = compare_scan(solved().run, solved().model.fixed->wave, "paper", measured);
  EXPECT_GT(found.conjugate_correlation, 0.99);
  EXPECT_THAT(scan_value(found, true)["note"].get<std::string>(),
              HasSubstr("the conjugate of what was measured fits better"));
}

TEST(ScanComparison, IsOfWhatSoundsWhereTheSolverDoesNotKnow) {
  const Solved weak({"array.tolerances={phase_deg: 60}"});
  const MeasuredPoints measured = weak.scan(0, 3.0, 0.0, true);
  EXPECT_NEAR(compare_scan(weak.run, weak.model.fixed->wave, "paper", measured).fit.scale, 3.0, 1e-10);
  RunData believed = weak.run;
  believed.array_truth.reset();
  EXPECT_GT(compare_scan(believed, weak.model.fixed->wave, "paper", measured).fit.relative, 0.2);
}

TEST(ScanComparison, PointsInTheBodyAndOnItsSkinAreNamedAndLeftOut) {
  MeasuredPoints measured = solved().scan(0, 1.0, 0.0, true);
  measured.points.col(3) = Vector3(0, 0, 56e-3);                 // the capsule's axis
  measured.points.col(4) = Vector3(0, 0, 49.5e-3);               // half a millimetre below its bottom
  measured.points.col(5) = solved().run.array.positions.col(9);  // on a transducer
  const ScanComparison found = compare_scan(solved().run, solved().model.fixed->wave, "paper", measured);
  EXPECT_EQ(found.used, 97U);
  EXPECT_EQ(found.points[3].left_out, "inside the body");
  EXPECT_THAT(found.points[4].left_out, HasSubstr("mm from the skin, nearer than the edge of"));
  EXPECT_EQ(found.points[5].left_out, "on a transducer");
  EXPECT_LT(found.fit.relative, 1e-10);
  const std::vector<bool> clear = clear_points(solved().run, measured.points.middleCols(2, 3));
  EXPECT_THAT(clear, ElementsAre(true, false, false));
  EXPECT_THAT(table_text(scan_points(found, true, true)), HasSubstr("0, 0, 56  "));
}

}  // namespace touchfield::scan_comparison_test
