#include "sim/assess/scan_setting.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "sim/acoustics/incident_field.h"
#include "sim/core/require.h"
#include "sim/core/rotation.h"
#include "sim/scene/number_table.h"
#include "sim/solve/run_field.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

Eigen::Matrix3d turn_of(const ScanSetting& setting) { return extrinsic_rotation(setting.segment<3>(kTurnX)); }

schema::Unit unit_of(const ScanValueInfo& value) {
  return value.unit == kDegree ? schema::Unit::degree()
                               : schema::Unit::power_of_ten(value.unit == kMillimetre ? -3 : 0);
}

constexpr double kMiddleWeight = 0.25;  // of the disc's mean; that of the ring is the rest

/// The middle of a disc and six places on a ring: exact for polynomials up to the fifth degree.
/// source   Abramowitz, Stegun, 25.4.61, the rule of 7 points
Points disc_places(double radius) {
  Points places = Points::Zero(3, 7);
  for (Eigen::Index i = 1; i < places.cols(); ++i) {
    const double angle = static_cast<double>(i) * std::numbers::pi / 3;
    places.col(i) = radius * std::sqrt(2.0 / 3.0) * Vector3(std::cos(angle), std::sin(angle), 0);
  }
  return places;
}

Wave true_wave(const Wave& wave, const ScanSetting& setting) {
  Medium medium = wave.medium();
  medium.sound_speed *= setting(kSoundSpeed);
  return {medium, wave.frequency()};
}

/// The mean over the opening of what has a row per point.
template <class Field>
Eigen::MatrixXcd over_opening(const Points& placed, const ScanSetting& setting, const Field& field) {
  if (setting(kReceiver) == 0) {
    return field(placed);
  }
  const Points disc = turn_of(setting) * disc_places(setting(kReceiver));
  const double ring_weight = (1 - kMiddleWeight) / static_cast<double>(disc.cols() - 1);
  Eigen::MatrixXcd mean = kMiddleWeight * field(placed);
  for (Eigen::Index i = 1; i < disc.cols(); ++i) {
    mean += ring_weight * field(placed.colwise() + disc.col(i));
  }
  return mean;
}

}  // namespace

ScanSetting unchanged_scan() {
  ScanSetting setting = ScanSetting::Zero();
  setting(kSize) = 1.0;
  setting(kSoundSpeed) = 1.0;
  return setting;
}

ScanSetting read_scan_setting(const std::string& path) {
  schema::TableForm form = {{}, "rows"};
  for (const ScanValueInfo& value : kScanValueInfo) {
    form.known.push_back({.name = value.name, .unit = unit_of(value), .range = schema::between(value.low, value.high)});
  }
  const schema::NumberTable table = schema::read_number_table(path, form);
  require(table.rows() == 1, "{}: {} rows of values, must be 1", path, table.rows());
  ScanSetting setting = unchanged_scan();
  for (int i = 0; i < kScanValues; ++i) {
    if (table.has(kScanValueInfo[i].name)) {
      setting(i) = table.columns.at(kScanValueInfo[i].name).front();
    }
  }
  return setting;
}

void write_scan_setting(const std::string& path, const ScanSetting& setting) {
  std::vector<std::string> names;
  std::vector<std::string> values;
  for (int i = 0; i < kScanValues; ++i) {
    names.emplace_back(kScanValueInfo[i].name);
    values.push_back(csv_number(setting(i) / kScanValueInfo[i].unit));
  }
  write_text_file(path, csv_line(names) + csv_line(values));
}

Points placed_points(const Points& points, const Vector3& middle, const ScanSetting& setting) {
  const Vector3 there = middle + setting.segment<3>(kPlaceX);
  return (setting(kSize) * turn_of(setting) * (points.colwise() - middle)).colwise() + there;
}

Eigen::VectorXcd scan_reading(const Run& run, const Wave& wave, const Points& placed, const ScanSetting& setting) {
  return over_opening(placed, setting, [&](const Points& points) -> Eigen::MatrixXcd {
    return run_field(run, true_wave(wave, setting), points).pressure;
  });
}

Eigen::MatrixXcd channel_readings(const TransducerArray& array, const Wave& wave, const Points& placed,
                                  const ScanSetting& setting) {
  return over_opening(placed, setting,
                      [&](const Points& points) { return incident_matrix(array, true_wave(wave, setting), points); });
}

}  // namespace touchfield
