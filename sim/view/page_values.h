#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

#include "sim/core/json.h"
#include "sim/view/view_data.h"

namespace touchfield {

std::string base64(std::string_view bytes);

/// Numbers for the page's script: {"type", "low", "high", "data"}. `data` is base64 of little-endian integers; a number
/// is low + (high - low) i / 65534, and 65535 stands for NaN.
///
/// accuracy   (high - low) / 131068, half a step
Json packed(const Eigen::Ref<const Eigen::VectorXd>& values);

/// One frame of a page. `faces`, also those of `sensed`, are null where they are those of the skin before.
Json skin_json(const ViewSkin& skin);

/// What the script reads: all but the text of the page. A live page has no skins; it gets them by events.
Json page_json(const ViewData& data, bool live);

}  // namespace touchfield
