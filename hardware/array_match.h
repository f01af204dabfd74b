#pragma once

#include <string>

#include "sim/acoustics/transducer_array.h"

namespace touchfield {

/// Farthest that a transducer of a run may be from where the device has it, once the one array is laid on the other
/// [m].
inline constexpr double kMatchTolerance = 1e-4;
/// Where along its axis a transducer is compared as well, so that the tolerance allows 10 mrad of its direction [m].
inline constexpr double kMatchReach = 1e-2;

/// Refuses an array that is not the device's. The array may be moved and turned as a whole. It must agree with the
/// device in count, places, axes, and the order of units and channels.
///
/// run      an array as a run has it
/// device   the device's own layout
/// name     of the device, for the message
/// throws   InputError saying what differs: the count, the pitch, the order, a place or direction, a number
void require_match(const TransducerArray& run, const ArrayLayout& device, const std::string& name);

}  // namespace touchfield
