#pragma once

#include <optional>

namespace touchfield {

/// Those channels of touch in glabrous skin that follow vibration.
enum class TouchChannel { kPacinian, kRapidlyAdapting };

/// Threshold of the skin's displacement, relative to that of the Pacinian channel at 250 Hz [dB].
///
/// Pacinian           falls by 12 dB per octave from 40 to 250 Hz, then rises by 9 dB per octave to 500 Hz.
/// rapidly adapting   flat from 10 to 40 Hz, where the channels meet.
///
/// hz        > 0
/// returns   nothing outside these ranges, where no source says what the channel does
/// accuracy  published slopes, without a spread: thenar eminence, contactor of 2.9 cm2, bursts of 1 s. The rise was
///           measured on the forearm, from 220 Hz. The text of the papers was read, not their figures.
/// source    Gescheider and Verrillo, 10.1007/978-1-4613-3039-4_10, abstract (fall, flat part, on Verrillo 1963);
///           Verrillo, Vibrotactile thresholds for hairy skin, J. Exp. Psychol. (1966), abstract (rise);
///           docs/felt.md, "Thresholds" (ranges, meeting)
std::optional<double> relative_threshold(TouchChannel channel, double hz);

}  // namespace touchfield
