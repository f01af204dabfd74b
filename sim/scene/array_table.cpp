#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/scene/number_files.h"
#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

const Range kPitch = above_to(0, 1000);

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
      .key("count", &GridArray::count, tuple_of<int, 2>(integer(between(1, 1000))), "Transducers along x and y.")
      .key("pitch_mm", &GridArray::pitch, number(kMillimetres, kPitch), "Distance between neighbours [mm].")
      .codec();
}

Codec<Autd3Array> autd3_codec() {
  const auto unit = Map<Placement>()
                        .required("at_mm", &Placement::at, vector3(kMillimetres, {}), "[0, 0, 0]",
                                  "Where the unit's transducer 0 is [mm].")
                        .key("rotate_deg", &Placement::angles, vector3(kDegrees, {}),
                             "Rotation about transducer 0: about x, then y, then z [deg].")
                        .codec();
  return Map<Autd3Array>()
      .maybe("layout", &Autd3Array::layout, tuple_of<int, 2>(integer(between(1, 100))), "",
             "Units edge to edge along x and y.")
      .defaults_to("[3, 2]")
      .maybe("units", &Autd3Array::units, list_of(unit, 1, 1000), "", "Or each unit's own place.")
      .written_if([](const Autd3Array& array) { return !array.layout; })
      .key("pitch_mm", &Autd3Array::pitch, number(kMillimetres, kPitch),
           "Distance between neighbours [mm]; boards of 2016 to 2019 had 10.18.")
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
    in.at(*in.node().find("axes"))
        .problem(fmt::format("{} axes, must be {} as there are points", form.axes->cols(), count));
    return std::nullopt;
  }
  bool good = true;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (const auto axis = unit_vector(form.axes->col(i))) {
      array.axes.col(i) = *axis;
    } else {
      in.at(*in.node().find("axes")).at(static_cast<std::size_t>(i)).problem("zero, an axis must have a direction");
      good = false;
    }
  }
  return good ? std::optional(array) : std::nullopt;
}

Codec<PositionsArray> positions_codec() {
  const auto from_file = kept_as<PositionsFile, std::string>(file(), read_positions, nullptr);
  return kept_as<PositionsArray, PositionsFile>(
      Map<PositionsFile>()
          .maybe("points_mm", &PositionsFile::points, points(kMillimetres, {}), "[[-5, 0, 0], [5, 0, 0]]",
                 "Where the transducers are [mm].")
          .maybe("axes", &PositionsFile::axes, points(kPlain, {}), "[[0, 0, 1], [0, 0, 1]]",
                 "Directions the transducers emit along, one each, of any length; +z if left out.")
          .allowed_with({"points_mm"})
          .add({.name = "file",
                .type = from_file.type,
                .help = "A table of transducers. Its header names the columns, in any order: x_mm, y_mm and, if there "
                        "are, z_mm, the axis nx, ny, nz, alive (0 or 1); lengths in um, mm, cm or m (x_m). Without a "
                        "header: x_mm,y_mm,z_mm or x_mm,y_mm,z_mm,nx,ny,nz.",
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

}  // namespace

Codec<ArraySpec> array_codec() {
  using Kind = Directivity::Kind;
  return Map<ArraySpec>()
      .maybe("grid", &ArraySpec::layout, grid_codec(), "", "A flat rectangle of transducers, its middle on at_mm.")
      .maybe("autd3", &ArraySpec::layout, autd3_codec(), "", "AUTD3 units of 249 transducers each.")
      .maybe("sonicsurface", &ArraySpec::layout, Map<SonicsurfaceArray>().codec(), "{}",
             "The open-hardware board of 16 x 16 transducers at 10.5 mm, its middle on at_mm.")
      .maybe("positions", &ArraySpec::layout, positions_codec(), "", "Transducers anywhere.")
      .maybe("plane_wave", &ArraySpec::layout, plane_wave_codec(), "",
             "One channel, a plane wave; its phase is 0 at the origin.")
      .key("at_mm", &ArraySpec::at, vector3(kMillimetres, {}), "Where the array's own origin is in the world [mm].")
      .key("rotate_deg", &ArraySpec::angles, vector3(kDegrees, {}),
           "Rotation about the array's own origin: about x, then y, then z [deg].")
      .key("directivity", &ArraySpec::directivity,
           choice<Kind>({{"omni", Kind::kOmni}, {"piston", Kind::kPiston}, {"t4010a1", Kind::kT4010a1}}),
           "How a transducer radiates away from its axis: alike everywhere, as a piston, or as measured for the "
           "AUTD3's.")
      .key("piston_radius_mm", &ArraySpec::piston_radius, number(kMillimetres, above_to(0, 1000)),
           "Radius of a piston [mm]; of no effect on other directivities.")
      .key("level", &ArraySpec::level, number(kPlain, above_to(0, 1)), "Drive of every transducer, 1 at full.")
      .key("source_pa_m", &ArraySpec::source_strength, number(kPlain, above(0)),
           "Pressure amplitude of a transducer at full drive on its axis times the distance [Pa m].")
      .maybe("calibration", &ArraySpec::calibration, calibration_codec(), "",
             "Responses of the channels as they were measured.")
      .maybe("spread", &ArraySpec::spread, spread_codec(), "",
             "Responses of the channels drawn at random; beside a calibration they multiply.")
      .maybe(
          "phase_levels", &ArraySpec::phase_levels, integer(between(2, 65536)), "256",
          "Steps a turn that the true array rounds the solved phases to, as a device does; not at all if left out. The "
          "solver does not know.")
      .exactly_one({"grid", "autd3", "sonicsurface", "positions", "plane_wave"})
      .check([](const Input& in, ArraySpec& spec, bool good) { return !good || check_calibration(in, spec); })
      .codec();
}

}  // namespace touchfield::schema
