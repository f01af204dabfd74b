#pragma once

#include "sim/core/types.h"

namespace touchfield {

/// A homogeneous fluid at rest.
struct Medium {
  double sound_speed;  // c [m/s]
  double density;      // rho [kg/m3]
  double absorption;   // alpha [Np/m] at the frequency in use; 0: none
};

/// 20 C, where the tabulated values of air() hold [K].
inline constexpr double kRoomTemperature = 293.15;

/// Dry air at atmospheric pressure: c = 343.21 sqrt(T / 293.15) m/s, rho = 1.2041 (293.15 / T) kg/m3, no absorption.
///
/// temperature   [K], 223.15 to 333.15
/// throws        InputError outside that range
/// source        ideal gas scaled from the tabulated values at 20 C
Medium air(double temperature);

/// Absorption of sound in air at 101.325 kPa, alpha [Np/m].
///
/// temperature         [K]
/// relative_humidity   0 to 1
/// frequency           [Hz]
/// source              ISO 9613-1:1993, eqs. 3-5 and annex B; 1.318 dB/m at 40 kHz, 20 C, 50 %
double air_absorption(double temperature, double relative_humidity, double frequency);

/// A time-harmonic wave exp(-i omega t) in a medium.
class Wave {
 public:
  /// frequency   [Hz], > 0
  /// throws      InputError if the frequency or a property of the medium is not positive (absorption: negative)
  Wave(const Medium& medium, double frequency);

  const Medium& medium() const { return medium_; }
  double frequency() const { return frequency_; }                  // [Hz]
  double omega() const;                                            // [rad/s]
  double k() const { return k_; }                                  // Re of the wavenumber [rad/m]
  Complex wavenumber() const { return {k_, medium_.absorption}; }  // k + i alpha [1/m]
  double wavelength() const;                                       // [m]

 private:
  Medium medium_;
  double frequency_;
  double k_;
};

}  // namespace touchfield
