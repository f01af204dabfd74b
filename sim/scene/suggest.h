#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/schema_info.h"

namespace touchfield::schema {

/// Smallest number of insertions, deletions, replacements and swaps of neighbours that turn a into b
/// (optimal string alignment: no letter is edited twice).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// A key without the unit it ends in: radius_cm -> radius, source_pa_m -> source.
std::string_view without_unit(std::string_view key);

/// The one of `words` that differs from `text` in the fewest letters; empty if none is near.
std::string nearest_word(const std::vector<std::string>& words, std::string_view text);

/// The known key that an unknown one was probably meant to be, as it is written from this map. It is a key of the map
/// with another unit or a few other letters, or a key of a map one level below ("box.size_mm"). Empty if none is near.
std::string nearest_key(const MapInfo& map, std::string_view unknown);

}  // namespace touchfield::schema
