#include <utility>

#include <fmt/format.h>

#include "sim/scene/number_files.h"
#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

Codec<ResponseOf> response_of_codec() {
  return choice<ResponseOf>(
      {{"both", ResponseOf::kBoth}, {"solver", ResponseOf::kSolver}, {"truth", ResponseOf::kTruth}});
}

constexpr const char* kIn =
    "Channels with these responses. both: those of the solver and of the true array. solver: a wrong assumption of the "
    "solver. truth: the true array only; the evaluation and the fields include them, the solver does not.";

/// What a calibration lists must be one a channel.
bool check_listed(const Input& calibration, const char* key, std::size_t count, Eigen::Index channels) {
  if (count == static_cast<std::size_t>(channels)) {
    return true;
  }
  const Entry* entry = calibration.node().find(key);
  return (entry ? calibration.at(*entry) : calibration)
      .problem(fmt::format("{} value{}, must be {}: one per channel", count, count == 1 ? "" : "s", channels));
}

}  // namespace

Codec<CalibrationSpec> calibration_codec() {
  return Map<CalibrationSpec>()
      .maybe("file", &CalibrationSpec::file, file(), "calibration.csv",
             "A table with a header and one row per channel: channel (from 0), gain, phase_rad or phase_deg, and "
             "optionally alive (0 or 1).")
      .maybe(
          "gain", &CalibrationSpec::gain, list_of(number(kPlain, between(0, 10)), 1, kMostListed), "[1, 0.9]",
          "Instead of a file the gains, one per channel: the measured pressure divided by the designed one; 0 is dead.")
      .maybe("phase_rad", &CalibrationSpec::phase, list_of(number(kPlain, {}), 1, kMostListed), "[0, 0.2]",
             "The phases, one per channel [rad], each added to that of the drive.")
      .needed_with({"gain"})
      .key("in", &CalibrationSpec::in, response_of_codec(), kIn)
      .exactly_one({"file", "gain"})
      .codec();
}

Codec<ToleranceSpec> tolerance_codec() {
  const Unit percent = Unit::power_of_ten(-2);
  return Map<ToleranceSpec>()
      .key("gain_percent", &ToleranceSpec::gain, number(percent, between(0, 100)),
           "Standard deviation of the gains, normal about 1 [%]; negative values become 0.")
      .shown_as("10")
      .key("phase_deg", &ToleranceSpec::phase, number(kDegrees, between(0, 360)),
           "Standard deviation of the phases, normal about 0 [deg].")
      .key("dead_percent", &ToleranceSpec::dead, number(percent, between(0, 100)),
           "Probability that a channel is dead [%].")
      .key("seed", &ToleranceSpec::seed, seed(), "Seed of the random responses.")
      .key("in", &ToleranceSpec::in, response_of_codec(), kIn)
      .codec();
}

bool check_calibration(const Input& array, ArraySpec& spec) {
  const Entry* entry = array.node().find("calibration");
  if (auto* positions = std::get_if<PositionsArray>(&spec.layout); positions && !positions->dead.empty()) {
    if (entry) {
      return array.at(*entry).problem("array.positions.file says which transducers are dead; leave one of them out");
    }
    const auto channels = static_cast<std::size_t>(positions->points.cols());
    spec.calibration = CalibrationSpec{};
    spec.calibration->gain.assign(channels, 1.0);
    spec.calibration->phase.assign(channels, 0.0);
    for (const Eigen::Index dead : std::exchange(positions->dead, {})) {
      spec.calibration->gain[static_cast<std::size_t>(dead)] = 0.0;
    }
    return true;
  }
  if (!entry || !spec.calibration) {
    return true;
  }
  const Input in = array.at(*entry);
  CalibrationSpec& calibration = *spec.calibration;
  const Eigen::Index channels = channel_count(spec);
  if (calibration.file.empty()) {
    const bool good = check_listed(in, "gain", calibration.gain.size(), channels);
    return check_listed(in, "phase_rad", calibration.phase.size(), channels) && good;
  }
  auto file = read_named(in.key("file"),
                         [&] { return read_calibration(calibration.file, static_cast<std::size_t>(channels)); });
  if (!file) {
    return false;
  }
  calibration.gain = std::move(file->gain);
  calibration.phase = std::move(file->phase);
  calibration.file.clear();
  return true;
}

}  // namespace touchfield::schema
