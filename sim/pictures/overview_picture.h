#pragma once

#include <string>

#include "sim/pictures/picture_format.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// The skin of a run side by side: what is wanted, if there is a target, and what each method reaches, with its error.
/// Whole bodies above and the target's surroundings below; of more than kMostColumns the surroundings alone, in rows.
///
/// top       end of the colours [Pa]
/// returns   a file's bytes
std::string overview_picture(const Run& run, double top, PictureFormat format);

}  // namespace touchfield
