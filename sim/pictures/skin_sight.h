#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "sim/acoustics/transducer_array.h"
#include "sim/core/types.h"
#include "sim/mesh/raster/raster.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/pictures/canvas.h"

namespace touchfield {

/// A parallel projection into a panel of a picture.
struct SkinView {
  PixelBox panel;
  Vector3 direction;  // of sight, unit
  Vector3 up;         // unit, perpendicular to it
  Vector3 centre;     // [m], in the middle of the panel
  double scale;       // [m] a pixel

  Vector3 right() const { return direction.cross(up); }
  Eigen::Vector2d pixel(const Vector3& point) const;
};

/// The direction in which an array faces, its mean axis; for a plane wave its direction of travel. From the array to
/// `centre` where the axes cancel, +z where that fails too.
Vector3 facing(const TransducerArray& array, const Vector3& centre);

/// Looks along `direction`, with world +y up, or +x if +y is nearly the direction of sight. All points together fill
/// `share` of the panel in the tighter of its two sides.
SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Points& points, double share);

/// The same with another direction up.
/// vertical   not along `direction`
SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Vector3& vertical, const Points& points,
                     double share);

/// The colour of a face at a point of it [m].
using ColourAt = std::function<Colour(int face, const Vector3& x)>;

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

  /// The same with colours that change within faces.
  ColourImage image(const ColourAt& colour_at, int finer) const;

  /// The pieces of edges, 2 x E numbers of points [m], that no face hides [pixels of the picture]: the ends of one
  /// after another. They are found in steps of half a pixel.
  std::vector<Eigen::Vector2d> visible(const Points& points, const Eigen::Matrix2Xi& edges) const;

 private:
  template <class ColourOf>
  ColourImage made_image(const ColourOf& colour_of, int finer) const;

  SkinView view_;
  Camera camera_;
  Raster raster_;
  std::vector<std::uint8_t> shade_;  // of each sample: 255 leaves the colour alone
};

}  // namespace touchfield
