
#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/acoustics/array_geometry.h"
#include "sim/core/errors.h"
#include "sim/scene/scene_reader.h"
#include "sim/store/run_layout.h"

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

SharedArray array_of_scene(const std::string& path, const std::vector<std::string>& overrides) {
  const Scene scene = read_scene(path, overrides);
  return shared(build_array(scene.array, Wave(build_medium(scene.medium, scene.frequency), scene.frequency)));
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
          [](nb::handle scene, nb::handle set) { return array_of_scene(path_of(scene), overrides_of(set, {})); },
          nb::arg("scene"), nb::arg("set") = nb::none(),
          nb::sig("def of_scene(scene: str | os.PathLike, set: dict[str, typing.Any] | None = None) -> Array"),
          "The array that a scene file describes.")
      .def_prop_ro("positions", part_of<SharedArray>(&TransducerArray::positions))
      .def_prop_ro("normals", part_of<SharedArray>(&TransducerArray::axes))
      .def_prop_ro("strengths", part_of<SharedArray>(&TransducerArray::amplitudes),
                   "Pressure times distance at full drive [Pa m]; of a plane wave [Pa].")
      .def("__len__", [](const SharedArray& self) { return self->size(); })
      .def("__repr__",
           [](const SharedArray& self) { return fmt::format("<touchfield.Array: {} channels>", self->size()); });
}

}  // namespace touchfield::python
