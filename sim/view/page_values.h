#pragma once

#include <string>
#include <string_view>
#include <vector>

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

/// One frame of a page. `faces`, also those of `sensed`, are null where they are those of the mesh before.
///
/// before, sensed_before   null: there is none
Json skin_json(const ViewSkin& skin, const TriangleMesh* before = nullptr, const TriangleMesh* sensed_before = nullptr);

/// The ends of the colours of these skins [Pa]: of |p| and, unless its factor is NaN, of the radiation pressure.
Json tops_json(const std::vector<ViewSkin>& skins, double radiation_per_square);

/// What the script reads: all but the text of the page.
///
/// live   as of view_page
Json page_json(const ViewData& data, const std::string& live);

}  // namespace touchfield
