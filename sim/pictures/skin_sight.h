#pragma once

#include <cstdint>
#include <vector>

#include "sim/mesh/raster/raster.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/pictures/colour_image.h"
#include "sim/pictures/skin_view.h"

namespace touchfield {

/// A mesh looked at in a panel: what every picture of it shares, whatever its colours. Each pixel is seen at 4 x 4
/// places, whose colours are averaged.
class SkinSight {
 public:
  SkinSight(const SkinView& view, const TriangleMesh& mesh);

  const SkinView& view() const { return view_; }

  /// The panel with one colour per face on white. Skin that is seen head-on has exactly its colour. Slanted skin is
  /// darker, down to 70 %; the light follows the normal, interpolated between vertices except at creases.
  /// finer   1, 2 or 4: how many pixels of the image a pixel of the picture has along each side
  ColourImage image(const std::vector<Colour>& colours, int finer) const;

  /// The pieces of edges, 2 x E numbers of points [m], that no face hides [pixels of the picture]: the ends of one
  /// after another. They are found in steps of half a pixel.
  std::vector<Eigen::Vector2d> visible(const Points& points, const Eigen::Matrix2Xi& edges) const;

 private:
  SkinView view_;
  Camera camera_;
  Raster raster_;
  std::vector<std::uint8_t> shade_;  // of each sample: 255 leaves the colour alone
};

}  // namespace touchfield
