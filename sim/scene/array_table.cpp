#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "sim/scene/number_files.h"
#include "sim/scene/scene.h"
#include "sim/scene/scene_table.h"

namespace touchfield {

namespace {

struct ChannelCounter {
  Eigen::Index operator()(const GridArray& grid) const { return Eigen::Index{grid.count[0]} * grid.count[1]; }
  Eigen::Index operator()(const Autd3Array& autd3) const {
    const Eigen::Index units = autd3.layout ? Eigen::Index{(*autd3.layout)[0]} * (*autd3.layout)[1]
                                            : static_cast<Eigen::Index>(autd3.units.size());
    return units * autd3_unit(autd3.pitch).positions.cols();
  }
  Eigen::Index operator()(const SonicsurfaceArray&) const { return sonicsurface_layout().positions.cols(); }
  Eigen::Index operator()(const PositionsArray& list) const { return list.points.cols(); }
  Eigen::Index operator()(const PlaneWaveArray&) const { return 1; }
};

bool belongs(ResponseOf in, ResponseOf array) { return in == ResponseOf::kBoth || in == array; }

ChannelResponse response_of(const ArraySpec& spec, ResponseOf array) {
  ChannelResponse response;
  if (spec.calibration && belongs(spec.calibration->in, array)) {
    const auto count = static_cast<Eigen::Index>(spec.calibration->gain.size());
    response = {Eigen::Map<const Eigen::VectorXd>(spec.calibration->gain.data(), count),
                Eigen::Map<const Eigen::VectorXd>(spec.calibration->phase.data(), count)};
  }
  if (spec.tolerances && belongs(spec.tolerances->in, array)) {
    response = product(response, random_response(channel_count(spec), *spec.tolerances, spec.tolerances->seed));
  }
  return response;
}

}  // namespace

Eigen::Index channel_count(const ArraySpec& spec) { return std::visit(ChannelCounter{}, spec.layout); }

ChannelResponses channel_responses(const ArraySpec& spec) {
  return {response_of(spec, ResponseOf::kSolver), response_of(spec, ResponseOf::kTruth)};
}

bool solver_mistakes_channels(const ArraySpec& spec) {
  return (spec.calibration && spec.calibration->in != ResponseOf::kBoth) ||
         (spec.tolerances && spec.tolerances->in != ResponseOf::kBoth) || spec.phase_levels;
}

}  // namespace touchfield

namespace touchfield::schema {

namespace {

const Range kPitch = above_to(0, 1000);
constexpr Eigen::Index kMostChannels = 100'000;  // nobody has built a tenth of it; meshes take minutes with more

// A vector of unit length stays as it is, to the bit, so that a resolved scene reads back the same.
std::optional<Vector3> unit_vector(const Vector3& v) {
  if (std::abs(v.squaredNorm() - 1) < 16 * std::numeric_limits<double>::epsilon()) {
    return v;
  }
  const double largest = v.cwiseAbs().maxCoeff();
  if (largest == 0) {
    return std::nullopt;
  }
  return (v / largest).normalized();
}

Codec<GridArray> grid_codec() {
  return Map<GridArray>()
      .key("count", &GridArray::count, tuple_of<int, 2>(integer(between(1, 1000))),
           "Number of transducers along x and y.")
      .key("pitch_mm", &GridArray::pitch, number(kMillimetres, kPitch), "Distance between neighbours [mm].")
      .codec();
}

Codec<Autd3Array> autd3_codec() {
  const auto unit = Map<Placement>()
                        .required("at_mm", &Placement::at, vector3(kMillimetres, {}), "[0, 0, 0]",
                                  "Position of the unit's transducer 0 [mm].")
                        .key("rotate_deg", &Placement::angles, vector3(kDegrees, {}),
                             "Rotation about transducer 0: about x, then y, then z [deg].")
                        .codec();
  return Map<Autd3Array>()
      .maybe("layout", &Autd3Array::layout, tuple_of<int, 2>(integer(between(1, 100))), "",
             "Number of units along x and y, edge to edge.")
      .defaults_to("[3, 2]")
      .maybe("units", &Autd3Array::units, list_of(unit, 1, 1000), "", "The place of each unit, instead of layout.")
      .key("pitch_mm", &Autd3Array::pitch, number(kMillimetres, kPitch),
           "Distance between neighbours [mm]; boards of 2016 to 2019 have 10.18.")
      .at_most_one({"layout", "units"})
      .check([](const Input& in, Autd3Array& array, bool /*good*/) {
        if (!in.node().find("units") && !in.node().find("layout")) {
          array.layout = {3, 2};
        }
        return true;
      })
      .codec();
}

std::optional<PositionsArray> to_positions(const Input& in, const PositionsFile& form) {
  const auto count = form.points.cols();
  PositionsArray array{.points = form.points, .axes = Vector3::UnitZ().replicate(1, count), .dead = form.dead};
  if (!form.axes) {
    return array;
  }
  if (form.axes->cols() != count) {
    in.key("axes").problem(fmt::format("{} axes, must be {}: one per point", form.axes->cols(), count));
    return std::nullopt;
  }
  bool good = true;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (const auto axis = unit_vector(form.axes->col(i))) {
      array.axes.col(i) = *axis;
    } else {
      good = in.key("axes").at(static_cast<std::size_t>(i)).problem("zero, an axis must have a direction");
    }
  }
  return good ? std::optional(array) : std::nullopt;
}

Codec<PositionsArray> positions_codec() {
  const auto from_file = kept_as<PositionsFile, std::string>(
      file(),
      [](const Input& in, const std::string& path) { return read_named(in, [&] { return read_positions(path); }); },
      nullptr);
  return kept_as<PositionsArray, PositionsFile>(
      Map<PositionsFile>()
          .maybe("points_mm", &PositionsFile::points, points(kMillimetres, {}), "[[-5, 0, 0], [5, 0, 0]]",
                 "Positions of the transducers [mm].")
          .maybe("axes", &PositionsFile::axes, points(kPlain, {}), "[[0, 0, 1], [0, 0, 1]]",
                 "Directions in which the transducers emit, one per transducer, of any length; default: +z.")
          .allowed_with({"points_mm"})
          .add({.name = "file",
                .type = from_file.type,
                .help = "A table of transducers. Its header names the columns in any order: x_mm, y_mm and optionally "
                        "z_mm, the axis nx, ny, nz, and alive (0 or 1). Lengths are in um, mm, cm or m (x_m).",
                .example = "array.csv"},
               from_file.read, [](const PositionsFile&) { return std::nullopt; })
          .exactly_one({"points_mm", "file"})
          .codec(),
      to_positions, [](const PositionsArray& array) {
        return PositionsFile{array.points, array.axes, {}};
      });
}

Codec<PlaneWaveArray> plane_wave_codec() {
  const auto direction = kept_as<Vector3, Vector3>(
      vector3(kPlain, {}),
      [](const Input& in, const Vector3& v) {
        auto unit = unit_vector(v);
        if (!unit) {
          in.problem("zero, a direction must not be");
        }
        return unit;
      },
      [](const Vector3& v) { return v; });
  return Map<PlaneWaveArray>()
      .key("direction", &PlaneWaveArray::direction, direction, "Direction of travel, of any length.")
      .key("amplitude_pa", &PlaneWaveArray::amplitude, number(kPlain, above(0)), "Pressure amplitude [Pa].")
      .codec();
}

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

/// Reads the calibration file of an array with good keys. Reports and returns false if the file, or the list in its
/// place, does not fit the channels. Dead transducers of a positions file get the gain 0 instead. Then a calibration as
/// well is an error.
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

}  // namespace

Codec<ArraySpec> array_codec() {
  using Kind = Directivity::Kind;
  return Map<ArraySpec>()
      .maybe("grid", &ArraySpec::layout, grid_codec(), "", "A flat rectangle of transducers with its centre at at_mm.")
      .maybe("autd3", &ArraySpec::layout, autd3_codec(), "", "AUTD3 units of 249 transducers each.")
      .maybe("sonicsurface", &ArraySpec::layout, Map<SonicsurfaceArray>().codec(), "{}",
             "The open-hardware board of 16 x 16 transducers at 10.5 mm, with its centre at at_mm.")
      .maybe("positions", &ArraySpec::layout, positions_codec(), "", "Transducers anywhere.")
      .maybe("plane_wave", &ArraySpec::layout, plane_wave_codec(), "",
             "One channel, a plane wave; its phase is 0 at the origin.")
      .key("at_mm", &ArraySpec::at, vector3(kMillimetres, {}), "Position of the array's own origin in the world [mm].")
      .key("rotate_deg", &ArraySpec::angles, vector3(kDegrees, {}),
           "Rotation about the array's own origin: about x, then y, then z [deg].")
      .key("directivity", &ArraySpec::directivity,
           choice<Kind>({{"omni", Kind::kOmni}, {"piston", Kind::kPiston}, {"t4010a1", Kind::kT4010a1}}),
           "Radiation of a transducer off its axis: the same in all directions, that of a piston, or that measured for "
           "the AUTD3 transducer.")
      .key("piston_radius_mm", &ArraySpec::piston_radius, number(kMillimetres, above_to(0, 1000)),
           "Radius of a piston [mm]; no effect on other directivities.")
      .key("level", &ArraySpec::level, number(kPlain, above_to(0, 1)),
           "Common amplitude of all channels; 1 is full drive.")
      .key("source_pa_m", &ArraySpec::source_strength, number(kPlain, above(0)),
           "Pressure amplitude of a transducer at full drive on its axis times the distance [Pa m].")
      .maybe("calibration", &ArraySpec::calibration, calibration_codec(), "", "Measured responses of the channels.")
      .maybe("tolerances", &ArraySpec::tolerances, tolerance_codec(), "",
             "Tolerances: random responses of the channels. They multiply those of a calibration.")
      .maybe("phase_levels", &ArraySpec::phase_levels, integer(between(2, 65536)), "256",
             "Phase levels of the true array, to which it rounds the solved phases, as a device does. Default: no "
             "rounding. The solver does not include it.")
      .exactly_one({"grid", "autd3", "sonicsurface", "positions", "plane_wave"})
      .check([](const Input& in, ArraySpec& spec, bool good) {
        const Eigen::Index channels = good ? channel_count(spec) : 0;
        if (channels > kMostChannels) {
          return in.problem(fmt::format("{} transducers, must be at most {}", channels, kMostChannels));
        }
        return !good || check_calibration(in, spec);
      })
      .codec();
}

}  // namespace touchfield::schema
