#pragma once

#include <string>

#include "sim/pictures/picture_format.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// A picture of the array's transducers and the skin from the side and somewhat above the array, in parallel
/// projection, the target's outline in red.
///
/// run   its array has transducers and is no plane wave
std::string setup_picture(const Run& run, PictureFormat format);

/// Discs of 16 corners at the transducers, turned as they are. Their radius is 5 mm, or 0.45 times the least distance
/// between two transducers if that is less.
TriangleMesh transducer_discs(const TransducerArray& array);

}  // namespace touchfield
