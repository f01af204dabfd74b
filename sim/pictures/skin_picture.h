#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/pictures/canvas.h"
#include "sim/pictures/picture_format.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_sight.h"
#include "sim/run/run_data.h"

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
  std::string colours;  // what shares them, a sentence
};

/// Pieces of straight lines, from point(0, e) to point(1, e).
struct Lines {
  Points points;          // 3 x P [m]
  Eigen::Matrix2Xi ends;  // 2 x E
};

/// A skin looked at once, with the outline of its target, drawn in panels of one size.
class SkinLook {
 public:
  SkinLook(const SkinView& view, const TriangleMesh& mesh, const std::optional<Target>& target);

  const SkinView& view() const { return sight_.view(); }
  void draw(Canvas& canvas, const std::vector<Colour>& colours, const PixelBox& panel) const;

  /// What the target wants, up to its border.
  void draw_wanted(Canvas& canvas, const Target& target, double top, const PixelBox& panel) const;

 private:
  void draw_outline(Canvas& canvas, const PixelBox& panel) const;

  SkinSight sight_;
  std::vector<Eigen::Vector2d> outline_;
};

/// The skin of a run, looked at once for all its pictures.
class SkinPictures {
 public:
  /// run   outlives this
  SkinPictures(const Run& run, PictureFormat format);
  SkinPictures(const Run&&, PictureFormat) = delete;

  /// A picture of the skin coloured by `values` [Pa], one per face, with the target outlined.
  std::string picture(const Eigen::VectorXd& values, const SkinScale& scale, const SkinText& text) const;

  /// The same of what the target wants, up to its border.
  std::string wanted_picture(double top, const SkinText& text) const;

 private:
  std::string drawn(const std::function<void(const SkinLook&, Canvas&)>& draw, double largest, const SkinScale& scale,
                    const SkinText& text) const;

  const Run& run_;
  PictureFormat format_;
  SkinLook body_;
  std::optional<SkinLook> target_;
};

/// The lines where the surfaces of the target's boxes cut the skin. Lines within another box are left out unless they
/// are a border of the target or between two pressures. Masks, and targets without boxes, have other lines: the sides
/// of their faces that no other such face shares.
Lines target_outline(const TriangleMesh& mesh, const Target& target);

/// The twelve edges of each box of the target.
Lines box_edges(const std::vector<TargetBox>& boxes);

/// The corners of the target's faces, 3 x 3 K.
Points target_corners(const TriangleMesh& mesh, const Target& target);

inline constexpr Colour kTargetColour = {0, 120, 80};

/// The skin of a run side by side: what is wanted, if there is a target, and what each method reaches, with its error.
/// Whole bodies above and the target's surroundings below; of more than kMostColumns the surroundings alone, in rows.
///
/// top       end of the colours [Pa]
/// returns   a file's bytes
std::string overview_picture(const Run& run, double top, PictureFormat format);

}  // namespace touchfield
