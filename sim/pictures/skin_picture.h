#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "sim/mesh/raster/raster.h"
#include "sim/pictures/picture_parts.h"
#include "sim/run/run_data.h"

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

/// How wide and high points are, looked at along `direction` [m].
Eigen::Vector2d seen_size(const Vector3& direction, const Points& points);

/// Means over the faces round each vertex, weighted by area: R x V of R x M. Faces with a value that is not finite do
/// not count; NaN where none does.
Eigen::MatrixXd vertex_means(const TriangleMesh& mesh, const Eigen::MatrixXd& of_faces);

/// The colour of a face where its corners have these shares.
using ColourAt = std::function<Colour(int face, const Vector3& shares)>;

/// A skin looked at once, with the outline of its target, drawn in panels of one size.
class SkinLook {
 public:
  /// mesh   outlives this
  SkinLook(const SkinView& view, const TriangleMesh& mesh, const std::optional<Target>& target);
  SkinLook(const SkinView& view, const TriangleMesh&& mesh, const std::optional<Target>& target) = delete;

  /// Values of the faces, smooth: their means at the vertices, linear between these.
  void draw(Canvas& canvas, const Eigen::VectorXd& values, double top, const PixelBox& panel) const;

  /// What is wanted on the faces of a target, up to its border; smooth within it where no level changes.
  void draw_wanted(Canvas& canvas, const Target& target, const Eigen::VectorXd& wanted, double top,
                   const PixelBox& panel) const;

  /// A pixel of the panel, column i and row j from its lower left corner: the mean of 4 x 4 places, on white. Skin that
  /// is seen head-on has exactly its colour. Slanted skin is darker, down to 70 %; the light follows the normal,
  /// interpolated between vertices except at creases.
  Colour pixel(int i, int j, const ColourAt& colour_at) const;

  /// The pieces of lines from one point to the next, 3 x 2 E [m], that no face hides [pixels of the picture]: the ends
  /// of one after another. They are found in steps of half a pixel.
  std::vector<Eigen::Vector2d> visible(const Points& ends) const;

 private:
  Vector3 shares(int face, const Eigen::Vector2d& sample) const;
  void paint(Canvas& canvas, const ColourAt& colour_at, const PixelBox& panel) const;

  SkinView view_;
  const TriangleMesh& mesh_;
  Camera camera_;
  SeenPoints seen_;
  Raster raster_;
  std::vector<std::uint8_t> shade_;  // of each sample: 255 leaves the colour alone
  std::vector<Eigen::Vector2d> outline_;
};

/// The end of the colours of skin: `most`, rounded up. Where a pressure is wanted it is, before rounding, at least that
/// and at most twice that. A method that presses ten times as hard then leaves the others their colours.
///
/// most_wanted   0 where nothing is wanted
/// most          the largest 99.5th percentile of the methods, so that a single hot face does not darken all others
double skin_top(double most_wanted, double most);

/// The colours of values on the skin, which call themselves `label`. Both ends are rounded outwards. Below 0 they end
/// at -top at the most.
///
/// methods   values on the faces, one entry per method
ColourBar skin_bar(const std::string& label, double most_wanted, const std::vector<Eigen::VectorXd>& methods);

/// The lines where the surfaces of the target's boxes cut the skin, from one point to the next, 3 x 2 E. Lines within
/// another box are left out unless they are a border of the target or between two pressures. Masks, and targets without
/// boxes, have other lines: the sides of their faces that no other such face shares.
Points target_outline(const TriangleMesh& mesh, const Target& target);

/// The corners of the target's faces, 3 x 3 K.
Points target_corners(const TriangleMesh& mesh, const Target& target);

inline constexpr Colour kTargetColour = {0, 120, 80};

/// Panels of the overview that show the same part of the skin: first what is wanted, if there is a target, then one per
/// method.
struct OverviewPart {
  PanelGrid grid;
  SkinView view;  // in the first panel
};

/// All of the skin, and the target's surroundings where they would be small; seen from the array's side (facing).
std::vector<OverviewPart> overview_parts(const Run& run);

/// The skin of a run, its methods side by side with their errors and widths. It shows the radiation pressure P, by
/// which methods are compared, or |p| where a method has no P.
///
/// returns   a file's bytes
std::string overview_picture(const Run& run);

}  // namespace touchfield
