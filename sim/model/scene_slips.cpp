#include "sim/model/scene_slips.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "sim/acoustics/array_geometry.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
// Turns that phases in radians are apart at most, unless they are unwrapped over a large array.
constexpr double kMostOfDrives = 4.0;
constexpr double kMostOfResponses = 2.0;

/// Empty, or what to say of phases [rad] that may be degrees or levels.
///
/// most   turns that they may be apart, unless all are whole numbers
std::string phases_slip(const std::string& what, const std::vector<double>& phases, double most) {
  if (phases.empty()) {
    return "";
  }
  const auto [first, last] = std::ranges::minmax(phases);
  const bool whole = std::ranges::all_of(phases, [](double phase) { return phase == std::round(phase); });
  const double turns = (last - first) / kTurn;
  return turns <= (whole ? 1.0 : most)
             ? ""
             : fmt::format(
                   "unit_slip: {}: phases from {:.4g} to {:.4g} rad, which are {:.1f} turns apart{}. Multiply "
                   "degrees by pi / 180, and levels of 256 by 2 pi / 256. Unwrapped phases are right as they are",
                   what, first, last, turns, whole ? ", and all are whole numbers" : "");
}

std::string source_slip(const ArraySpec& spec) {
  constexpr double kMostSource = 50.0;  // [Pa m]
  if (spec.source_strength <= kMostSource) {
    return "";
  }
  return fmt::format(
      "unit_slip: array.source_pa_m: {:.6g} Pa m are {:.3g} times the AUTD3 transducer's {:g} Pa m. Divide Pa mm by "
      "1000; a level in dB is another quantity",
      spec.source_strength, spec.source_strength / kAutd3SourceStrength, kAutd3SourceStrength);
}

std::string piston_slip(const ArraySpec& spec, const TransducerArray& array, double wavelength) {
  constexpr double kOverlap = 1.1;
  constexpr double kTiny = 0.01;  // wavelengths
  const double radius = spec.piston_radius;
  const double pitch = array.size() > 1 ? array_geometry(array).least_pitch : HUGE_VAL;
  if (2.0 * radius > kOverlap * pitch) {
    return fmt::format(
        "unit_slip: array.piston_radius_mm: pistons with a radius of {:.4g} mm overlap at a pitch of {:.4g} mm. The "
        "key takes the radius, in mm",
        radius / kMillimetre, pitch / kMillimetre);
  }
  return radius < kTiny * wavelength
             ? fmt::format("unit_slip: array.piston_radius_mm: a radius of {:.4g} mm is {:.2g} % of the wavelength{}",
                           radius / kMillimetre, 100.0 * radius / wavelength, metres_hint(radius * Vector3::UnitX()))
             : "";
}

std::string frequency_slip(const Scene& scene) {
  constexpr double kMeasured = 40e3;  // [Hz]
  constexpr double kNear = 0.1;
  if (std::abs(scene.frequency / kMeasured - 1.0) <= kNear) {
    return "";
  }
  return fmt::format(
      "directivity_frequency: array.directivity t4010a1 was measured at {:g} kHz, and frequency_khz is {:g}; piston "
      "follows the frequency",
      kMeasured / 1e3, scene.frequency / 1e3);
}

std::string dead_slip(const MethodSpec& method, const ArraySpec& array) {
  constexpr double kNotable = 0.3;
  const double expected = method.tolerances ? method.tolerances->dead : 0.0;
  const double real = array.tolerances ? array.tolerances->dead : 0.0;
  if (expected - real < kNotable) {
    return "";
  }
  return fmt::format(
      "expected_dead: method {} expects that {:.3g} % of the channels are dead, and array.tolerances has {:.3g} %. "
      "With the channels that sound the pressure is up to {:.2g} times the wanted one",
      method.name, 100.0 * expected, 100.0 * real, (1.0 - real) / (1.0 - expected));
}

}  // namespace

std::string metres_hint(const Vector3& length) {
  constexpr double kFarthest = 2.0 * kMillimetre;
  if (length.isZero() || length.cwiseAbs().maxCoeff() > kFarthest) {
    return "";
  }
  const Vector3 typed = length / kMillimetre;
  if ((typed.array() != 0).count() == 1) {
    const double number = typed.sum();
    return fmt::format(". If {:.6g} is in metres write {:.6g}", number, 1e3 * number);
  }
  return fmt::format(". If [{:.6g}, {:.6g}, {:.6g}] is in metres write [{:.6g}, {:.6g}, {:.6g}]", typed.x(), typed.y(),
                     typed.z(), 1e3 * typed.x(), 1e3 * typed.y(), 1e3 * typed.z());
}

std::vector<std::string> scene_slips(const Scene& scene, const TransducerArray& array, double wavelength,
                                     const TriangleMesh& mesh) {
  constexpr double kSmallestBody = 0.5 * kMillimetre;
  constexpr double kThinnestGas = 0.05;  // [kg/m3]
  std::vector<std::string> slips;
  const Vector3 size = mesh.vertices().rowwise().maxCoeff() - mesh.vertices().rowwise().minCoeff();
  if (size.maxCoeff() < kSmallestBody) {
    slips.push_back(fmt::format("unit_slip: the bodies are {:.3g} mm across in all{}", size.norm() / kMillimetre,
                                metres_hint(size)));
  }
  if (scene.medium.density && *scene.medium.density < kThinnestGas) {
    slips.push_back(
        fmt::format("unit_slip: medium.density_kg_m3: {:.3g} kg/m3 is less than any gas has; multiply g/cm3 "
                    "by 1000",
                    *scene.medium.density));
  }
  if (scene.array.calibration) {
    slips.push_back(phases_slip("array.calibration", scene.array.calibration->phase, kMostOfResponses));
  }
  if (array.kind == TransducerArray::Kind::kTransducers) {
    slips.push_back(source_slip(scene.array));
    if (scene.array.directivity == Directivity::Kind::kPiston) {
      slips.push_back(piston_slip(scene.array, array, wavelength));
    } else if (scene.array.directivity == Directivity::Kind::kT4010a1) {
      slips.push_back(frequency_slip(scene));
    }
  }
  for (const MethodSpec& method : scene.solve.methods) {
    slips.push_back(phases_slip("method " + method.name, method.phases, kMostOfDrives));
    slips.push_back(dead_slip(method, scene.array));
  }
  for (const FieldSpec& field : scene.fields) {
    const Vector3& length = field.size.isZero() ? field.centre : field.size;
    if (const std::string hint = metres_hint(length); !hint.empty()) {
      slips.push_back(fmt::format("unit_slip: field {} is {:.3g} mm {}{}", field.name, length.norm() / kMillimetre,
                                  field.size.isZero() ? "from the origin" : "across", hint));
    }
  }
  std::erase(slips, "");
  return slips;
}

}  // namespace touchfield
