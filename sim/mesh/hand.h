#pragma once

#include <string>
#include <vector>

#include "sim/mesh/body.h"

namespace touchfield {

enum class HandSide { kRight, kLeft };

/// The built-in hand: published bone lengths and finger thicknesses, posed by joint angles, skin as a smooth implicit
/// surface over the bones.
struct HandOptions {
  std::string pose = "index_up";  // one of hand_poses()
  double breadth = 88.3e-3;       // [m], across the metacarpal heads; 0.05 to 0.15
  double length = 193.3e-3;       // [m], crease of the wrist to middle fingertip with the hand flat; 0.12 to 0.26
  HandSide side = HandSide::kRight;
  double edge = 3e-3;  // wanted edge length [m]; 0.4e-3 to 8e-3
};

/// Names of the poses that hand() knows.
std::vector<std::string> hand_poses();

/// A closed, manifold, outwardly oriented hand in its own frame: origin at the wrist joint, x to the thumb's side (of
/// a right hand; a left hand is its mirror image in x), y to the fingertips, z out of the back of the hand. The crease
/// of the wrist, from which the length counts, lies 0.073 lengths behind the wrist joint, the end of the skin 20 mm.
///
/// accuracy    mean edge within 3 % of the wanted one; area and volume of the default hand in pose flat 447 cm2 and
///             336 cm3 (published: 425 and 340), the same at every edge up to 3 mm within 0.5 %
/// landmarks   thumb_pad, index_pad, middle_pad, ring_pad, little_pad (middle of the distal segment, palm side),
///             thumb_tip ... little_tip (the far end), palm_centre, back_centre, wrist (palm side). A landmark of a
///             curled finger that is pressed into the palm lies on the skin nearest to it
/// throws      InputError on an unknown pose or a value out of range
/// source      Buryanov & Kotiuk 2010 (bones); ANSUR II (length and breadth)
Body hand(const HandOptions& options);

}  // namespace touchfield
