
#include <cmath>
#include <nanobind/stl/tuple.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/acoustics/array_geometry.h"
#include "sim/acoustics/incident_field.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/run/run_data.h"
#include "sim/scene/scene_reader.h"

namespace touchfield::python {

namespace {

constexpr double kCelsius = 273.15;  // [K]

Wave wave_of(double frequency, double temperature, bool absorption) {
  if (!(frequency >= kLeastFrequency && frequency <= kMostFrequency)) {
    throw InputError(
        fmt::format("Wave: frequency = {:g} Hz must be {:g} to {:g} Hz", frequency, kLeastFrequency, kMostFrequency));
  }
  MediumSpec medium;
  medium.temperature = temperature + kCelsius;
  medium.absorption = absorption;
  return {build_medium(medium, frequency), frequency};
}

Directivity::Kind directivity_of(const std::string& name) {
  for (const auto kind : {Directivity::Kind::kOmni, Directivity::Kind::kPiston, Directivity::Kind::kT4010a1}) {
    if (name == directivity_name(kind)) {
      return kind;
    }
  }
  throw InputError(fmt::format("Array: directivity = '{}' must be omni, piston or t4010a1", name));
}

SharedArray array_of(nb::handle positions, nb::handle axes, const std::string& directivity, double level,
                     double source_strength, double piston_radius, const Wave& wave) {
  require(level > 0 && level <= 1, "Array: level = {:g} must be > 0 and <= 1", level);
  require(source_strength > 0 && std::isfinite(source_strength), "Array: source_strength = {:g} must be > 0",
          source_strength);
  require(piston_radius > 0 && piston_radius <= 1, "Array: piston_radius = {:g} m must be > 0 and <= 1", piston_radius);
  ArraySpec spec;
  PositionsArray layout{point_rows(positions, "Array: positions"), {}};
  layout.axes =
      axes.is_none() ? Points(Vector3::UnitZ().replicate(1, layout.points.cols())) : point_rows(axes, "Array: normals");
  require_count("Array: normals", layout.axes.cols(), layout.points.cols(), "per position");
  TransducerArray bare;
  bare.positions = layout.points;
  bare.axes = layout.axes;
  require_real_array(bare, wave.wavelength(), "Array: positions", "are they in m?");
  for (const std::string& warning : array_warnings(bare, wave.wavelength())) {
    say({Remark::Kind::kWarning, warning});
  }
  spec.layout = std::move(layout);
  spec.directivity = directivity_of(directivity);
  spec.level = level;
  spec.source_strength = source_strength;
  spec.piston_radius = piston_radius;
  const Json keys = {{"directivity", directivity},
                     {"level", level},
                     {"source_pa_m", source_strength},
                     {"piston_radius_mm", piston_radius / kMillimetre}};
  return {shared(build_array(spec, wave)), keys.dump()};
}

/// What an array is made of: whether it is a plane wave, positions, axes, amplitudes, name and k b of the directivity,
/// units, channels on them, gains and phases of the responses, keys of a scene.
nb::tuple array_state(const SharedArray& array) {
  return nb::make_tuple(array->kind == TransducerArray::Kind::kPlaneWave, owned(array->positions), owned(array->axes),
                        owned(array->amplitudes), directivity_name(array->directivity.kind()), array->directivity.ka(),
                        owned(array->device), owned(array->channel), owned(array->response.gain),
                        owned(array->response.phase), array.keys);
}

SharedArray array_of_state(const nb::tuple& state) {
  const auto numbers = [&](int item) { return real_list(state[item], "Array: state"); };
  TransducerArray array;
  array.kind = nb::cast<bool>(state[0]) ? TransducerArray::Kind::kPlaneWave : TransducerArray::Kind::kTransducers;
  array.positions = point_rows(state[1], "Array: state");
  array.axes = point_rows(state[2], "Array: state");
  array.amplitudes = numbers(3);
  switch (directivity_of(nb::cast<std::string>(state[4]))) {
    case Directivity::Kind::kOmni:
      array.directivity = Directivity::omni();
      break;
    case Directivity::Kind::kPiston:
      array.directivity = Directivity::piston(nb::cast<double>(state[5]), 1);
      break;
    case Directivity::Kind::kT4010a1:
      array.directivity = Directivity::t4010a1();
      break;
  }
  array.device = numbers(6).cast<int>();
  array.channel = numbers(7).cast<int>();
  array.response = {numbers(8), numbers(9)};
  return {shared(std::move(array)), nb::cast<std::string>(state[10])};
}

/// At the points of an array of any shape (..., 3), NaN on a transducer: (...) for one drive, (..., S) for several.
ComplexArray free_field(const SharedArray& array, const ArrayLike& points, const DrivesLike& drives,
                        const std::optional<Wave>& wave, std::optional<int> threads) {
  const nb::object given = nb::module_::import_("numpy").attr("asarray")(points);
  auto shape = nb::cast<std::vector<Eigen::Index>>(nb::object(nb::list(given.attr("shape"))));
  const bool grid = shape.size() > 2;
  const Points at = point_rows(grid ? given.attr("reshape")(-1, shape.back()) : given, "Array.field: points");
  const Eigen::MatrixXcd q = drive_columns(drives, "Array.field: drives", array->size());
  const nb::object pressure = owned(computed(thread_count(threads), [=, sound = wave_or_default(wave)](Progress&) {
    Eigen::MatrixXcd values = incident_pressure(*array, sound, at, q);
    return values;
  }));
  shape.pop_back();
  if (!is_one_drive(drives)) {
    shape.push_back(q.cols());
  }
  return nb::object(pressure.attr("reshape")(shape));
}

ComplexArray free_transfer(const SharedArray& array, const ArrayLike& points, const std::optional<Wave>& wave,
                           std::optional<int> threads) {
  const Points at = point_rows(points, "Array.transfer: points");
  return owned(computed(thread_count(threads),
                        [=, sound = wave_or_default(wave)](Progress&) { return incident_matrix(*array, sound, at); }));
}

SharedSolution free_focus(const SharedArray& array, const ArrayLike& point, const std::optional<Wave>& wave) {
  const Eigen::VectorXd at = real_list(point, "Array.focus: point");
  require_count("Array.focus: point", at.size(), 3, "per axis");
  const Eigen::MatrixXcd row = incident_matrix(*array, wave_or_default(wave), Points(at));
  return shared(full_drive(-row.row(0).transpose().cwiseArg()));
}

void add_wave(nb::module_& module) {
  nb::class_<Wave>(module, "Wave", nb::type_slots(kOpenInit), R"(Sound of one frequency in air.

Parameters
----------
frequency : float
    1e3 to 200e3 [Hz].
temperature : float
    -50 to 60 [degrees C].
absorption : bool
    Whether the air absorbs sound.

Raises
------
InputError
    On a value out of range.

Examples
--------
>>> round(1e3 * tf.Wave(40e3).wavelength, 2)
8.58
)")
      .def(
          "__init__",
          [](Wave* self, double frequency, double temperature, bool absorption) {
            new (self) Wave(wave_of(frequency, temperature, absorption));
          },
          nb::arg("frequency") = 40e3, nb::kw_only(), nb::arg("temperature") = 20.0, nb::arg("absorption") = false)
      .def_prop_ro("frequency", &Wave::frequency, "[Hz]")
      .def_prop_ro("wavelength", &Wave::wavelength, "[m]")
      .def_prop_ro("k", &Wave::k, "Wavenumber [rad/m].")
      .def_prop_ro(
          "sound_speed", [](const Wave& wave) { return wave.medium().sound_speed; }, "[m/s]")
      .def_prop_ro(
          "density", [](const Wave& wave) { return wave.medium().density; }, "Of the air [kg/m3].")
      .def("__getstate__",
           [](const Wave& wave) {
             const Medium& medium = wave.medium();
             return std::tuple(wave.frequency(), medium.sound_speed, medium.density, medium.absorption);
           })
      .def("__setstate__",
           [](Wave& self, const std::tuple<double, double, double, double>& state) {
             const auto& [frequency, sound_speed, density, absorption] = state;
             new (&self) Wave({sound_speed, density, absorption}, frequency);
           })
      .def("__repr__", [](const Wave& wave) {
        return fmt::format("<touchfield.Wave: {:g} kHz, wavelength {:.3f} mm>", 1e-3 * wave.frequency(),
                           1e3 * wave.wavelength());
      });
}

}  // namespace

Wave wave_or_default(const std::optional<Wave>& wave) {
  return wave ? *wave : Wave(build_medium({}, Scene{}.frequency), Scene{}.frequency);
}

void add_arrays(nb::module_& module) {
  add_wave(module);
  nb::class_<SharedArray>(module, "Array", nb::type_slots(kOpenInit), R"(Transducers. An array never changes.

Parameters
----------
positions : array_like, shape (N, 3)
    [m]
normals : array_like, shape (N, 3), optional
    Unit vectors along which they emit; default: +z.
directivity : {"t4010a1", "piston", "omni"}
    Radiation off the axis: that measured for the AUTD3 transducer, that of a piston, or the same in all directions.
level : float
    Common amplitude of all channels at full drive, 0 < level <= 1.
source_strength : float
    Pressure at full drive on the axis times the distance [Pa m].
piston_radius : float
    [m]
wave : Wave, optional
    Needed for pistons only; default: ``Wave()``.

Raises
------
InputError
    On normals that are not of unit length, transducers in one place, positions that are not in m.

Examples
--------
>>> len(tf.Array([[0, 0, 0], [0.01, 0, 0]]))
2
)")
      .def(
          "__init__",
          [](SharedArray* self, const ArrayLike& positions, const ArrayLike& normals, const std::string& directivity,
             double level, double source_strength, double piston_radius, const std::optional<Wave>& wave) {
            new (self) SharedArray(array_of(positions, normals, directivity, level, source_strength, piston_radius,
                                            wave_or_default(wave)));
          },
          nb::arg("positions"), nb::arg("normals") = nb::none(), nb::kw_only(),
          nb::arg("directivity") = directivity_name(ArraySpec{}.directivity), nb::arg("level") = ArraySpec{}.level,
          nb::arg("source_strength") = ArraySpec{}.source_strength,
          nb::arg("piston_radius") = ArraySpec{}.piston_radius, nb::arg("wave") = nb::none())
      .def_static(
          "of_scene",
          [](const SceneLike& scene, const Changes& set) {
            const Scene read = scene_input(scene).read(overrides_of(set, {}));
            return SharedArray{
                shared(build_array(read.array, Wave(build_medium(read.medium, read.frequency), read.frequency)))};
          },
          nb::arg("scene"), nb::arg("set") = nb::none(),
          R"(The array that a scene describes, without meshing its body.

Parameters
----------
scene : str, os.PathLike or dict
    A file, YAML text, or a dict.
set : dict, optional
    Changes of the scene by key path.

Examples
--------
>>> array = tf.Array.of_scene("capsule")
)")
      .def_rw("_keys", &SharedArray::keys)
      .def_prop_ro("positions", part_of<SharedArray>(&TransducerArray::positions), "Shape (N, 3) [m].")
      .def_prop_ro("normals", part_of<SharedArray>(&TransducerArray::axes),
                   "Unit vectors along which the transducers emit, shape (N, 3).")
      .def_prop_ro("strengths", part_of<SharedArray>(&TransducerArray::amplitudes),
                   "Pressure times distance at full drive [Pa m], shape (N,); of a plane wave [Pa].")
      .def_prop_ro("device", part_of<SharedArray>(&TransducerArray::device),
                   "Number of each transducer's unit from 0, shape (N,).")
      .def_prop_ro("channel", part_of<SharedArray>(&TransducerArray::channel),
                   "Number on that unit from 0, shape (N,).")
      .def("field", &free_field, nb::arg("points"), nb::arg("drives"), nb::arg("wave") = nb::none(),
           nb::arg("threads") = nb::none(),
           R"(The pressure in free air, without a body.

Parameters
----------
points : array_like, shape (..., 3)
    [m]
drives : array_like of complex, shape (N,) or (N, S), or Solution
    Amplitudes 0 to 1 and phases of the channels; S columns are S drive vectors.
wave : Wave, optional
    Default: ``Wave()``.
threads : int, optional

Returns
-------
numpy.ndarray of complex, shape (...) or (..., S)
    [Pa]; NaN on a transducer.

Examples
--------
>>> array = tf.Array.grid(16, 16)
>>> pressure = array.field([[0, 0, 0.15]], array.focus([0, 0, 0.15]))
>>> abs(pressure).round().tolist()
[6592.0]
)")
      .def("transfer", &free_transfer, nb::arg("points"), nb::arg("wave") = nb::none(), nb::arg("threads") = nb::none(),
           R"(The transfer matrix of points in free air.

Parameters
----------
points : array_like, shape (J, 3)
    [m]
wave : Wave, optional
    Default: ``Wave()``.
threads : int, optional

Returns
-------
numpy.ndarray of complex, shape (J, N)
    Pressure of each channel at full drive [Pa].

Examples
--------
>>> tf.Array.grid(16, 16).transfer([[0, 0, 0.15], [0, 0, 0.16]]).shape
(2, 256)
)")
      .def("focus", &free_focus, nb::arg("point"), nb::arg("wave") = nb::none(),
           R"(Phases with which the sound of all channels arrives in phase at a point in free air.

Parameters
----------
point : array_like, shape (3,)
    [m]
wave : Wave, optional
    Default: ``Wave()``.

Examples
--------
>>> phases = tf.Array.grid(16, 16).focus([0, 0, 0.15]).phases
)")
      .def("__getstate__", &array_state)
      .def("__setstate__",
           [](SharedArray& self, const nb::tuple& state) { new (&self) SharedArray(array_of_state(state)); })
      .def("__len__", [](const SharedArray& self) { return self->size(); })
      .def("__repr__",
           [](const SharedArray& self) { return fmt::format("<touchfield.Array: {} channels>", self->size()); });
}

}  // namespace touchfield::python
