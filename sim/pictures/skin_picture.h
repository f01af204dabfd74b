#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/pictures/skin_view.h"
#include "sim/store/run_data.h"

namespace touchfield {

/// Where the skin is seen in a picture: all of it, and the target's surroundings where they would be small.
struct SkinPanels {
  SkinView body;
  std::optional<SkinView> target;
};

/// Both look from the array's side; see facing().
SkinPanels skin_panels(const Run& run);

/// What a picture of the skin says beside its colours.
struct SkinText {
  std::string title;
  std::string subtitle;
  std::string caption;
};

/// A PNG of the skin coloured by `values` [Pa], one a face, from 0 to `top`, with the target outlined.
std::string skin_picture(const Run& run, const Eigen::VectorXd& values, double top, const SkinText& text);

/// Sides of the target's faces that no other face of the target shares, 2 x E vertices.
Eigen::Matrix2Xi target_outline(const TriangleMesh& mesh, const Target& target);

}  // namespace touchfield
