#pragma once

#include <string>

namespace touchfield {

/// A resolved scene with `right` and `left` of its hands exchanged. Until version 2 of run.h5 and 1 of motion.h5 each
/// of the words meant the other hand.
std::string with_sides_exchanged(const std::string& scene);

/// A resolved scene in which skin beyond keep_within is `nothing`. Until version 3 of run.h5 and 2 of motion.h5 there
/// was no such key, and that was so.
std::string with_nothing_beyond(const std::string& scene);

}  // namespace touchfield
