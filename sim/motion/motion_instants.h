#pragma once

#include <cstddef>

#include "sim/run/motion_data.h"

namespace touchfield {

/// How many instants a motion keeps: at most 48, and fewer, but at least 6, where they would take more than 512 MiB of
/// memory.
///
/// faces     of the evaluated skin
/// methods   whose pressures they have
int most_instants(Eigen::Index faces, std::size_t methods);

/// An instant that takes little room in a file: places are multiples of 2^-20 m, about 1 um. Pressures are within 1e-4
/// of the largest on that skin. A mesh with a face that is too thin for this stays as it is.
MotionInstant rounded(MotionInstant instant);

}  // namespace touchfield
