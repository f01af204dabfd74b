#pragma once

#include <vector>

namespace touchfield {

/// Sound pressure level of a sine, by its root mean square:
///
///   L = 20 log10(a / (sqrt(2) 20 uPa))
///
/// amplitude   a, the peak [Pa]
/// returns     [dB]; -infinity of silence
double sound_level(double amplitude);

/// A limit that somebody has published for airborne ultrasound at the ear, in a third-octave band.
struct ExposureLimit {
  const char* source;  // who, and the year
  const char* people;  // whom it is for
  double level;        // [dB re 20 uPa]
};

/// The published limits in the third-octave band of a frequency. They are figures of others, no assessment of safety.
///
/// frequency   [Hz]
/// returns     nothing in bands for which the sources give no limit: below that of 20 kHz, above that of 100 kHz
/// sources     INIRC-IRPA, Health Physics 46 (1984) 969; Health Canada, Safety Code 24 (1991); ACGIH, Threshold Limit
///             Values (2004), without the 30 dB that it adds where the body touches nothing that carries the sound
std::vector<ExposureLimit> exposure_limits(double frequency);

}  // namespace touchfield
