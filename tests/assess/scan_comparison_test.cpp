#include "sim/assess/scan_comparison.h"

#include <cmath>
#include <numbers>
#include <random>

#include <nlohmann/json.hpp>

#include "sim/assess/calibration_fit.h"
#include "sim/assess/scan_fit.h"
#include "sim/solve/run_field.h"
#include "sim/solve/solve_model.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"
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

TEST(ScanComparison, AnotherMethodsFieldDoesNotFit) {
  const MeasuredPoints measured = solved().scan(2, 1.0, 0.0, true);
  EXPECT_LT(compare_scan(solved().run, solved().model.fixed->wave, "focus", measured).fit.relative, 1e-10);
  EXPECT_GT(compare_scan(solved().run, solved().model.fixed->wave, "unscattered", measured).fit.relative, 0.1);
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
  const Solved weak({"array.spread={phase_deg: 60}"});
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
  EXPECT_THAT(table_text(scan_points(found, true, true)), HasSubstr("0, 0, 56  "));
}

TEST(ScanComparison, WhatCannotBeComparedIsRefused) {
  MeasuredPoints measured = solved().scan(0, 1.0, 0.0, false);
  const auto said = [&](const MeasuredPoints& points, const std::string& method) {
    return message_of<InputError>([&] { compare_scan(solved().run, solved().model.fixed->wave, method, points); });
  };
  EXPECT_EQ(said(measured, "gs"), "method gs: the run has no method of that name");
  MeasuredPoints silent = measured;
  silent.pressure.setZero();
  EXPECT_THAT(said(silent, "paper"), HasSubstr("the measured pressure is 0 at every point"));
  measured.points.colwise() = Vector3(0, 0, 56e-3);
  EXPECT_THAT(said(measured, "paper"), HasSubstr("0 of 100 measured points can be compared"));
}

/// The scan of a plane that does not cross the body, taken otherwise than its file says.
struct Misplaced {
  ScanSetting setting = unchanged_scan();
  MeasuredPoints measured;

  explicit Misplaced(bool complex, double noise = 0.0) {
    setting.head<6>() << 2e-3, -1e-3, 1.5e-3, 0.02, -0.01, 0.05;
    setting(kSize) = 1.04;
    setting(kReceiver) = 3e-3;
    measured.complex = complex;
    measured.points.resize(3, 400);
    for (Eigen::Index j = 0; j < 400; ++j) {
      measured.points.col(j) =
          1e-3 * Vector3(3.0 * static_cast<double>(j % 20) - 28, 3.0 * static_cast<double>(j / 20) - 28, 35);
      measured.lines.push_back(static_cast<int>(j) + 2);
    }
    const Points placed = placed_points(measured.points, measured.points.rowwise().mean(), setting);
    measured.pressure =
        0.3 * scan_reading(run_of_method(solved().run, "focus"), solved().model.fixed->wave, placed, setting);
    std::mt19937_64 bits(7);
    std::normal_distribution<double> normal;
    const double rms = measured.pressure.norm() / 20;
    for (Complex& p : measured.pressure) {
      p += noise * rms * std::numbers::sqrt2 / 2 * Complex(normal(bits), normal(bits));
      p = complex ? p : Complex(std::abs(p));
    }
  }

  ScanSetting fitted(const std::vector<std::string>& groups, const ScanSetting& start = unchanged_scan()) const {
    return fit_scan_setting(solved().run, solved().model.fixed->wave, "focus", measured, start, groups);
  }
};

TEST(ScanFit, FindsHowAScanWasTaken) {
  for (const bool complex : {true, false}) {
    const Misplaced scan(complex);
    const ScanSetting found = scan.fitted({"place", "turn", "size", "receiver"});
    EXPECT_LT((found - scan.setting).head<3>().cwiseAbs().maxCoeff(), 0.05e-3);
    EXPECT_LT((found - scan.setting).segment<3>(kTurnX).cwiseAbs().maxCoeff(), 2e-3);
    EXPECT_NEAR(found(kSize), 1.04, 1e-3);
    EXPECT_NEAR(found(kReceiver), 3e-3, 0.1e-3);
    EXPECT_EQ(found(kSoundSpeed), 1.0);
    const ScanComparison before = compare_scan(solved().run, solved().model.fixed->wave, "focus", scan.measured);
    const ScanComparison after = compare_scan(solved().run, solved().model.fixed->wave, "focus", scan.measured, found);
    EXPECT_GT(before.fit.relative, 0.2);
    EXPECT_LT(after.fit.relative, 0.01);
  }
}

TEST(ScanFit, HoldsWhatItIsNotAskedFor) {
  const Misplaced scan(false, 0.05);
  ScanSetting start = scan.setting;
  start.head<3>().setZero();
  const ScanSetting found = scan.fitted({"place"}, start);
  EXPECT_EQ(found.tail<6>(), start.tail<6>());
  EXPECT_LT((found - scan.setting).head<3>().cwiseAbs().maxCoeff(), 0.2e-3);
}

TEST(ScanFit, RefusesWhatThePointsDoNotDetermine) {
  Misplaced scan(true);
  scan.measured.points.row(0).setZero();  // a line along y: nothing turns about it
  scan.measured.points.row(2).setConstant(35e-3);
  EXPECT_THAT(message_of<InputError>([&] { scan.fitted({"turn"}); }),
              HasSubstr("--fit turn: the measured points do not determine ry_deg"));
}

TEST(ScanSetting, IsReadAsItWasWritten) {
  const TemporaryDirectory directory;
  const ScanSetting setting = Misplaced(true).setting;
  write_scan_setting(directory.file("fit.csv"), setting);
  EXPECT_LT((read_scan_setting(directory.file("fit.csv")) - setting).cwiseAbs().maxCoeff(), 1e-15);
  const auto read_written = [&](const std::string& text) {
    write_text_file(directory.file("typed.csv"), text);
    return read_scan_setting(directory.file("typed.csv"));
  };
  EXPECT_EQ(read_written("receiver_mm\n4.5\n")(kReceiver), 4.5e-3);
  EXPECT_THAT(message_of<InputError>([&] { read_written("size\n-1\n"); }), HasSubstr("must be 0.1 to 10"));
}

TEST(ScanReading, AReceiverReadsTheMeanOverItsOpening) {
  // Straight above a far transducer-like field: the mean of a plane wave at an angle is 2 J1(x)/x of the middle.
  RunData run = run_of_method(solved().run, "focus");
  run.array = plane_wave(Vector3(0.6, 0, 0.8), 1.0);
  run.methods.front().solution = PhaseSolution{};
  run.methods.front().solution.phases = Eigen::VectorXd::Zero(1);
  run.methods.front().solution.amplitudes = Eigen::VectorXd::Ones(1);
  run.methods.front().pressure.setZero();
  const Wave& wave = solved().model.fixed->wave;
  ScanSetting setting = unchanged_scan();
  setting(kReceiver) = 2.2 / (0.6 * wave.k());
  const Points at = Vector3(1e-3, 2e-3, 20e-3);
  const Complex middle = scan_reading(run, wave, at, unchanged_scan())(0);
  const Complex mean = scan_reading(run, wave, at, setting)(0);
  EXPECT_NEAR(std::abs(mean / middle - 2 * ::j1(2.2) / 2.2), 0, 0.01);
}

/// The body of a calibration is far away: what it scatters of the errors is not part of the estimate.
const Solved& far_away() {
  static const Solved kFarAway({"body.place.at_mm=[0, 0, 500]"});
  return kFarAway;
}

/// A complex scan over 64 channels with errors that the run does not know, 2 of them dead.
struct Twin {
  ChannelResponse truth = random_response(64, {.gain = 0.1, .phase = 0.25, .dead = 0.0, .seed = 3});
  MeasuredPoints measured;

  explicit Twin(Eigen::Index side = 24, double spacing = 5e-3, double noise = 0.02) {
    truth.gain(10) = truth.gain(37) = 0;
    measured.complex = true;
    measured.points.resize(3, side * side);
    for (Eigen::Index j = 0; j < measured.points.cols(); ++j) {
      measured.points.col(j) =
          Vector3(spacing * (static_cast<double>(j % side) - 0.5 * static_cast<double>(side - 1)),
                  spacing * (static_cast<double>(j / side) - 0.5 * static_cast<double>(side - 1)), 20e-3);
      measured.lines.push_back(static_cast<int>(j) + 2);
    }
    RunData real = run_of_method(far_away().run, "focus");
    real.array.response = truth;
    measured.pressure =
        std::polar(0.02, 1.0) * scan_reading(real, far_away().model.fixed->wave, measured.points, unchanged_scan());
    std::mt19937_64 bits(11);
    std::normal_distribution<double> normal;
    const double rms = measured.pressure.norm() / std::sqrt(static_cast<double>(measured.pressure.size()));
    for (Complex& p : measured.pressure) {
      p += noise * rms * std::numbers::sqrt2 / 2 * Complex(normal(bits), normal(bits));
    }
  }

  CalibrationFit fitted() const {
    return fit_calibration(far_away().run, far_away().model.fixed->wave, "focus", measured, unchanged_scan());
  }
};

TEST(CalibrationFit, FindsGainPhaseAndDeadChannels) {
  const Twin twin;
  const CalibrationFit found = twin.fitted();
  EXPECT_EQ(found.dead, 2);
  EXPECT_EQ(found.response.gain(10), 0);
  EXPECT_EQ(found.response.gain(37), 0);
  EXPECT_NEAR(found.noise, 0.02, 0.005);
  // A common factor cannot be known.
  Complex product = 0;
  const Eigen::VectorXcd mine = factors(found.response);
  const Eigen::VectorXcd true_ones = factors(twin.truth);
  product = mine.dot(true_ones) / mine.squaredNorm();
  const Eigen::VectorXd off = (product * mine - true_ones).cwiseAbs();
  EXPECT_LT(off.maxCoeff(), 4.5 * found.error.maxCoeff() + 0.01);
  EXPECT_LT(off.norm() / 8, 0.03);
  EXPECT_GT((true_ones.array() - 1).matrix().norm() / 8, 0.2);
}

TEST(CalibrationFit, WritesWhatASceneReads) {
  const TemporaryDirectory directory;
  const CalibrationFit found = Twin().fitted();
  write_calibration(directory.file("found.csv"), found.response);
  const Model model = small_model({"array.calibration={file: " + directory.file("found.csv") + "}"});
  EXPECT_LT((factors(model.fixed->array.response) - factors(found.response)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(CalibrationFit, RefusesScansThatDoNotSay) {
  const auto said = [](const Twin& twin) { return message_of<InputError>([&] { twin.fitted(); }); };
  EXPECT_THAT(said(Twin(8)), HasSubstr("must be at least 77 for 64 channels"));
  EXPECT_THAT(said(Twin(24, 0.5e-3)), HasSubstr("scan a larger plane"));
  Twin magnitudes;
  magnitudes.measured.complex = false;
  EXPECT_THAT(said(magnitudes), HasSubstr("must name p_re and p_im"));
}

}  // namespace touchfield::scan_comparison_test
