#pragma once

#include <string>

#include "sim/run/felt.h"
#include "sim/view/view_data.h"

namespace touchfield {

/// The radiation pressure on the evaluated skin, and the displacement of the soft, middle and stiff skin, rms.
/// Skin off the patch is grey, a green line is its border.
ViewData felt_view(const Felt& felt);

/// The page: the view, its figures, what they do not say, warnings and provenance.
///
/// picture   as of view_page
/// results   text
std::string felt_page(const Felt& felt, const std::string& picture, const std::string& results);

}  // namespace touchfield
