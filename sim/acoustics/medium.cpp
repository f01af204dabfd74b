#include "sim/acoustics/medium.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/require.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kReferenceSpeed = 343.21;    // [m/s] dry air at 20 C
constexpr double kReferenceDensity = 1.2041;  // [kg/m3] dry air at 20 C and 101.325 kPa

}  // namespace

Medium air(double temperature) {
  require(temperature >= 223.15 && temperature <= 333.15, "temperature = {} C must be -50 to 60",
          temperature - kZeroCelsius);
  return {kReferenceSpeed * std::sqrt(temperature / kRoomTemperature),
          kReferenceDensity * kRoomTemperature / temperature, 0.0};
}

double air_absorption(double temperature, double relative_humidity, double frequency) {
  // ISO 9613-1 with its own symbols; the ambient pressure is the reference pressure.
  const double t = temperature / kRoomTemperature;
  const double saturation = std::pow(10.0, -6.8346 * std::pow(273.16 / temperature, 1.261) + 4.6151);
  const double h = 100.0 * relative_humidity * saturation;  // molar concentration of water vapour [%]
  const double relaxation_o = 24.0 + 4.04e4 * h * (0.02 + h) / (0.391 + h);
  const double relaxation_n =
      std::pow(t, -0.5) * (9.0 + 280.0 * h * std::exp(-4.170 * (std::pow(t, -1.0 / 3.0) - 1.0)));
  const double f2 = frequency * frequency;
  const double classical = 1.84e-11 * std::sqrt(t);
  const double oxygen = 0.01275 * std::exp(-2239.1 / temperature) / (relaxation_o + f2 / relaxation_o);
  const double nitrogen = 0.1068 * std::exp(-3352.0 / temperature) / (relaxation_n + f2 / relaxation_n);
  // The standard's 8.686 dB/Np is left out: this is in Np/m.
  return f2 * (classical + std::pow(t, -2.5) * (oxygen + nitrogen));
}

Wave::Wave(const Medium& medium, double frequency)
    : medium_(medium), frequency_(frequency), k_(2.0 * std::numbers::pi * frequency / medium.sound_speed) {
  require(frequency > 0 && std::isfinite(frequency), "frequency = {} must be > 0", frequency);
  require(medium.sound_speed > 0 && std::isfinite(medium.sound_speed), "sound_speed = {} must be > 0",
          medium.sound_speed);
  require(medium.density > 0 && std::isfinite(medium.density), "density = {} must be > 0", medium.density);
  require(medium.absorption >= 0 && std::isfinite(medium.absorption), "absorption = {} must be >= 0",
          medium.absorption);
}

double Wave::omega() const { return 2.0 * std::numbers::pi * frequency_; }

double Wave::wavelength() const { return medium_.sound_speed / frequency_; }

}  // namespace touchfield
