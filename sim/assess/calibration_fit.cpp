#include "sim/assess/calibration_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "sim/assess/scan_comparison.h"
#include "sim/core/require.h"
#include "sim/solve/run_field.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

constexpr double kSpread = 0.5;  // of responses about 1: dead channels too are to be found
constexpr double kPointsPerChannel = 1.2;

double median(Eigen::VectorXd values) {
  auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The points of a scan that count: what was read, and what one factor makes of the run there.
struct CountingScan {
  Points placed;
  Eigen::VectorXcd measured;
};

CountingScan counting_scan(const ScanComparison& comparison) {
  CountingScan scan;
  const auto used = static_cast<Eigen::Index>(comparison.used);
  scan.placed.resize(3, used);
  scan.measured.resize(used);
  Eigen::Index row = 0;
  for (const ScanPoint& point : comparison.points) {
    if (point.left_out.empty()) {
      scan.placed.col(row) = point.at;
      scan.measured(row++) = point.measured;
    }
  }
  return scan;
}

/// Makes the median gain 1 and the sum real, and silences what is dead.
void normalise(CalibrationFit& fit, const Eigen::VectorXcd& responses) {
  const double middle = median(responses.cwiseAbs());
  const Complex turn = std::polar(1.0, -std::arg(responses.sum()));
  fit.error /= middle;
  fit.response.gain = responses.cwiseAbs() / middle;
  fit.response.phase = (turn * responses).cwiseArg();
  for (Eigen::Index n = 0; n < responses.size(); ++n) {
    if (fit.response.gain(n) < kDeadGain) {
      fit.response.gain(n) = 0;
      fit.response.phase(n) = 0;
      ++fit.dead;
    }
  }
}

}  // namespace

CalibrationFit fit_calibration(const Run& run, const Wave& wave, const std::string& method,
                               const MeasuredPoints& measured, const ScanSetting& setting) {
  require(measured.complex, "--calibration-out: the points have magnitudes alone, the header must name p_re and p_im");
  Run designed = run_of_method(run, method);
  const Eigen::VectorXcd drive = sounding_drives(designed).col(0);
  const Eigen::Index channels = drive.size();
  const auto silent = std::ranges::find(drive, Complex(0));
  require(silent == drive.end(), "--calibration-out: channel {} is not driven in method {}, all must be",
          silent - drive.begin(), method);
  const CountingScan scan = counting_scan(compare_scan(designed, wave, method, measured, setting));
  const Eigen::Index points = scan.measured.size();
  require(static_cast<double>(points) >= kPointsPerChannel * static_cast<double>(channels),
          "--calibration-out: {} points that count, must be at least {} for {} channels", points,
          std::ceil(kPointsPerChannel * static_cast<double>(channels)), channels);
  const Eigen::VectorXcd field = scan_reading(designed, wave, scan.placed, setting);
  const TransducerArray known = run.array_truth ? [&] {
    TransducerArray array = run.array;
    array.response = run.array_truth->response;
    return array;
  }() : run.array;
  const Eigen::VectorXcd scattered = field - channel_readings(known, wave, scan.placed, setting) * drive;
  designed.array.response = {};
  const Eigen::MatrixXcd readings = channel_readings(designed.array, wave, scan.placed, setting) * drive.asDiagonal();

  const ScanFit common = fit_scan(readings * Eigen::VectorXcd::Ones(channels) + scattered, scan.measured, true);
  const Complex factor = std::polar(common.scale, common.turn);
  const Eigen::VectorXcd rest = scan.measured - factor * (scattered + readings.rowwise().sum());  // of y = s
  const Eigen::MatrixXcd normal = readings.adjoint() * readings;
  const Eigen::VectorXcd gradient = readings.adjoint() * rest;
  const Eigen::VectorXcd plain = normal.ldlt().solve(gradient);
  const double variance = (rest - readings * plain).squaredNorm() / static_cast<double>(points - channels);
  const double prior = std::max(variance, 1e-24 * scan.measured.squaredNorm()) / std::pow(kSpread * common.scale, 2);
  const Eigen::MatrixXcd posterior = (normal + prior * Eigen::MatrixXcd::Identity(channels, channels))
                                         .llt()
                                         .solve(Eigen::MatrixXcd::Identity(channels, channels));

  CalibrationFit fit;
  fit.noise = std::sqrt(variance * static_cast<double>(points)) / scan.measured.norm();
  fit.error = (variance * posterior.diagonal().real().array()).sqrt() / common.scale;
  Eigen::Index worst = 0;
  require(
      fit.error.maxCoeff(&worst) <= kMostResponseError,
      "--calibration-out: the scan determines the response of channel {} within {:.2g} (standard deviation), must be "
      "within {}; scan a larger plane, nearer to the array, or with less noise",
      worst, fit.error.maxCoeff(), kMostResponseError);
  normalise(fit, (factor + (posterior * gradient).array()).matrix() / factor);
  return fit;
}

void write_calibration(const std::string& path, const ChannelResponse& response) {
  std::string text = csv_line({"channel", "gain", "phase_rad", "alive"});
  for (Eigen::Index n = 0; n < response.gain.size(); ++n) {
    text += csv_line({fmt::to_string(n), csv_number(response.gain(n)), csv_number(response.phase(n)),
                      response.gain(n) > 0 ? "1" : "0"});
  }
  write_text_file(path, text);
}

}  // namespace touchfield
