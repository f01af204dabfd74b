
#include <nanobind/stl/tuple.h>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/acoustics/array_geometry.h"
#include "sim/acoustics/incident_field.h"
#include "sim/core/errors.h"
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
  ArraySpec spec;
  PositionsArray layout{point_rows(positions, "Array: positions"), point_rows(axes, "Array: normals")};
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
  return shared(build_array(spec, wave));
}

SharedArray array_of_scene(const SceneInput& input, const std::vector<std::string>& overrides) {
  const Scene scene = input.read(overrides);
  return shared(build_array(scene.array, Wave(build_medium(scene.medium, scene.frequency), scene.frequency)));
}

/// What an array is made of: whether it is a plane wave, positions, axes, amplitudes, name and k b of the directivity,
/// units, channels on them, gains and phases of the responses.
nb::tuple array_state(const SharedArray& array) {
  return nb::make_tuple(array->kind == TransducerArray::Kind::kPlaneWave, owned(array->positions), owned(array->axes),
                        owned(array->amplitudes), directivity_name(array->directivity.kind()), array->directivity.ka(),
                        owned(array->device), owned(array->channel), owned(array->response.gain),
                        owned(array->response.phase));
}

TransducerArray array_of_state(const nb::tuple& state) {
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
  return array;
}

/// NaN on a transducer, as field() has it.
nb::object free_field(const SharedArray& array, nb::handle points, nb::handle drives, const Wave& wave,
                      std::optional<int> threads) {
  const Points at = point_rows(points, "Array.field: points");
  const Eigen::MatrixXcd q = drive_columns(drives, "Array.field: drives", array->size());
  return owned(computed(thread_count(threads), [=](Progress&) {
    Eigen::MatrixXcd pressure = incident_pressure(*array, wave, at, q);
    return pressure;
  }));
}

nb::object free_transfer(const SharedArray& array, nb::handle points, const Wave& wave, std::optional<int> threads) {
  const Points at = point_rows(points, "Array.transfer: points");
  return owned(computed(thread_count(threads), [=](Progress&) { return incident_matrix(*array, wave, at); }));
}

}  // namespace

void add_arrays(nb::module_& module) {
  nb::class_<Wave>(module, "Wave", "Sound of one frequency in air.")
      .def(
          "__init__",
          [](Wave* self, double frequency, double temperature, bool absorption) {
            new (self) Wave(wave_of(frequency, temperature, absorption));
          },
          nb::arg("frequency") = 40e3, nb::kw_only(), nb::arg("temperature") = kRoomTemperature - kCelsius,
          nb::arg("absorption") = MediumSpec{}.absorption, "frequency in Hz, temperature in degrees C.")
      .def_prop_ro("frequency", &Wave::frequency)
      .def_prop_ro("wavelength", &Wave::wavelength)
      .def_prop_ro("k", &Wave::k)
      .def_prop_ro("sound_speed", [](const Wave& wave) { return wave.medium().sound_speed; })
      .def_prop_ro("density", [](const Wave& wave) { return wave.medium().density; })
      .def(
          "__getstate__",
          [](const Wave& wave) {
            const Medium& medium = wave.medium();
            return std::tuple(wave.frequency(), medium.sound_speed, medium.density, medium.absorption);
          },
          nb::sig("def __getstate__(self) -> tuple[float, float, float, float]"))
      .def(
          "__setstate__",
          [](Wave& self, const std::tuple<double, double, double, double>& state) {
            const auto& [frequency, sound_speed, density, absorption] = state;
            new (&self) Wave({sound_speed, density, absorption}, frequency);
          },
          nb::sig("def __setstate__(self, state: tuple[float, float, float, float]) -> None"))
      .def("__repr__", [](const Wave& wave) {
        return fmt::format("<touchfield.Wave: {:g} kHz, wavelength {:.3f} mm>", 1e-3 * wave.frequency(),
                           1e3 * wave.wavelength());
      });
  nb::class_<SharedArray>(module, "Array", "Transducers, lengths in m. Immutable.")
      .def(
          "__init__",
          [](SharedArray* self, nb::handle positions, nb::handle normals, const std::string& directivity, double level,
             double source_strength, double piston_radius, std::optional<Wave> wave) {
            new (self) SharedArray(array_of(positions, normals, directivity, level, source_strength, piston_radius,
                                            wave ? *wave : wave_of(40e3, kRoomTemperature - kCelsius, false)));
          },
          nb::arg("positions"), nb::arg("normals"), nb::kw_only(),
          nb::arg("directivity") = directivity_name(ArraySpec{}.directivity), nb::arg("level") = ArraySpec{}.level,
          nb::arg("source_strength") = ArraySpec{}.source_strength,
          nb::arg("piston_radius") = ArraySpec{}.piston_radius, nb::arg("wave") = nb::none(),
          nb::sig("def __init__(self, positions: numpy.typing.ArrayLike, normals: numpy.typing.ArrayLike, *, "
                  "directivity: str = "
                  "'t4010a1', level: float = 1.0, source_strength: float = 4.386, piston_radius: float = 0.0045, wave: "
                  "Wave | None = None) -> None"),
          "`wave` is needed for pistons only, because their directivity depends on it.")
      .def_static(
          "of_scene",
          [](nb::handle scene, nb::handle set) { return array_of_scene(scene_input(scene), overrides_of(set, {})); },
          nb::arg("scene"), nb::arg("set") = nb::none(),
          nb::sig("def of_scene(scene: str | os.PathLike | tuple[str, str], set: dict[str, typing.Any] | None = None) "
                  "-> Array"),
          "The array that a scene file describes.")
      .def_prop_ro("positions", part_of<SharedArray>(&TransducerArray::positions))
      .def_prop_ro("normals", part_of<SharedArray>(&TransducerArray::axes))
      .def_prop_ro("strengths", part_of<SharedArray>(&TransducerArray::amplitudes),
                   "Pressure times distance at full drive [Pa m]; of a plane wave [Pa].")
      .def_prop_ro("directivity", [](const SharedArray& self) { return directivity_name(self->directivity.kind()); })
      .def_prop_ro("plane_wave",
                   [](const SharedArray& self) { return self->kind == TransducerArray::Kind::kPlaneWave; })
      .def("field", &free_field, nb::arg("points"), nb::arg("drives"), nb::arg("wave"), nb::arg("threads") = nb::none(),
           nb::sig("def field(self, points: numpy.typing.ArrayLike, drives: numpy.typing.ArrayLike, wave: Wave, "
                   "threads: int | None = None) -> numpy.typing.NDArray[numpy.complex128]"))
      .def("transfer", &free_transfer, nb::arg("points"), nb::arg("wave"), nb::arg("threads") = nb::none(),
           nb::sig("def transfer(self, points: numpy.typing.ArrayLike, wave: Wave, threads: int | None = None) -> "
                   "numpy.typing.NDArray[numpy.complex128]"))
      .def("__getstate__", &array_state, nb::sig("def __getstate__(self) -> tuple[typing.Any, ...]"))
      .def(
          "__setstate__",
          [](SharedArray& self, const nb::tuple& state) { new (&self) SharedArray(shared(array_of_state(state))); },
          nb::sig("def __setstate__(self, state: tuple[typing.Any, ...]) -> None"))
      .def("__len__", [](const SharedArray& self) { return self->size(); })
      .def("__repr__",
           [](const SharedArray& self) { return fmt::format("<touchfield.Array: {} channels>", self->size()); });
}

}  // namespace touchfield::python
