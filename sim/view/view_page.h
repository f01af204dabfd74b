#pragma once

#include <string>

#include "sim/run/run_data.h"
#include "sim/view/view_data.h"

namespace touchfield {

/// A page in HTML that is complete in itself: a browser opens it from disk and asks no host. It shows the skin in 3D by
/// WebGL 2, methods beside each other, planes of the field, the array, and curves over time.
///
/// picture   PNG, stands in where the browser has no WebGL 2; empty: none
/// below     HTML, follows the view
/// live      what tells its server from others: the skins come as server-sent events from `events` beside the page;
///           empty: they are in it
std::string view_page(const ViewData& data, const std::string& picture, const std::string& below,
                      const std::string& live = "");

/// What the page of a run shows: the skin that the metrics are of.
ViewData run_view(const Run& run);

/// The page of a run: the view, its figures, what to cite, warnings and provenance.
///
/// overview   PNG, the picture of that name; without it, it is drawn
std::string run_page(const Run& run, const std::string& overview);
std::string run_page(const Run& run);

}  // namespace touchfield
