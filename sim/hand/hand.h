#pragma once

#include <string>
#include <vector>

#include "sim/hand/body.h"
#include "sim/hand/hand_pose.h"
#include "sim/mesh/remesh/mesh_quality.h"

namespace touchfield {

/// The built-in hand: published bone lengths and finger thicknesses, posed by joint angles, skin as a smooth implicit
/// surface over the bones.
struct HandOptions {
  std::string pose = "index_up";  // one of hand_poses()
  double breadth = 88.3e-3;       // [m], across the metacarpal heads; 0.05 to 0.15
  double length = 193.3e-3;       // [m], crease of the wrist to middle fingertip with the hand flat; 0.12 to 0.26
  HandSide side = HandSide::kRight;
  double edge = 3e-3;   // wanted edge length of a uniform mesh [m]; kLeastHandEdge to kMostHandEdge
  HandJoints joints{};  // joints turned away from the pose
  double forearm = 0;   // how far the skin continues towards the elbow beyond the hand's own end [m]; 0 to kMostForearm
};

inline constexpr double kLeastHandEdge = 0.3e-3;  // [m]
inline constexpr double kMostHandEdge = 12e-3;    // [m]
inline constexpr double kMostForearm = 0.3;       // [m]
inline constexpr double kUsualForearm = 0.25;     // [m], of scenes and commands

/// Names of the poses that hand() knows:
///
///   flat
///   index_up     index finger straight, the others curled, the thumb over them
///   grasp        a box of 55 mm between the pads of the thumb and the fingers
///   point_down   index_up with the index finger bent a little, to point at an array
///   fist
std::vector<std::string> hand_poses();

/// A closed, manifold, outwardly oriented hand in its own frame. The origin is at the wrist joint, y points to the
/// fingertips and z out of the back of the hand. x points to the right as one sees the hand palm down with the fingers
/// away. So a right hand's thumb is at negative x. A left hand is the mirror image in x, with the thumb at positive x.
///
/// The length counts from the crease of the wrist, which lies 0.073 lengths behind the wrist joint. The hand's own end
/// lies 20 mm behind that joint. A forearm ends `forearm` behind the hand's own end.
///
/// Parts that touch, or that are nearer than 2.6 mm, merge. Edges above 5 mm are at most 0.45 of the flesh's thickness
/// and of a cleft's width (skin_mesh()). Where the skin cuts itself in a fold it is meshed again with edges half as
/// long about the place, up to three times.
///
/// sizing      wanted edge length by place in the hand's own frame, kLeastHandEdge to kMostHandEdge; without it,
///             uniform
/// landmarks   thumb_pad, index_pad, middle_pad, ring_pad, little_pad (middle of the distal segment, palm side),
///             thumb_tip ... little_tip (the far end), palm_centre, back_centre, wrist (palm side). The landmark of a
///             pad or tip that is pressed into other flesh lies on the skin nearest to it
/// accuracy    mean edge of a uniform mesh within 3 % of the wanted one from 2 mm on, 5 % below. Area and volume of the
///             default hand in pose flat are 445 cm2 and 343 cm3 (published: 425 and 340), the same at every edge up to
///             3 mm within 0.5 %. Finger thickness within 10 % of the published means. With far edges up to 12 mm the
///             volume is within 1.5 % of that of a fine mesh, and that of a finger within 6 %; the skin is within 6 mm
///             of that of the fine mesh
/// throws      InputError on an unknown pose, a value or an angle out of range, or if the skin cuts itself: the edges
///             are too long for a fold that the angles make
/// source      Buryanov & Kotiuk 2010 (bones); ANSUR II (length and breadth)
Body hand(const HandOptions& options);
Body hand(const HandOptions& options, const EdgeSizing& sizing);

/// The ball that holds a hand of this length [m] in any pose, without its forearm: edges are at most `edge` there.
SizingZone hand_zone(double length, double edge);

/// The place of a landmark of the hand [m], without meshing it. It lies on the implicit skin, within 0.5 mm of the
/// landmark of the same name on a mesh with edges up to 3 mm.
///
/// throws   InputError as hand() does, or listing the names there are
Vector3 hand_landmark(const HandOptions& options, const std::string& name);

/// About the signed distances of points from the implicit skin [m], negative inside, without meshing it: within 0.2 mm
/// up to 3 mm from the skin.
///
/// points   in the hand's own frame [m]
/// throws   InputError as hand_landmark() does
Eigen::VectorXd hand_distances(const HandOptions& options, const Points& points);

}  // namespace touchfield
