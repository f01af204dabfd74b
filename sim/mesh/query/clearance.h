#pragma once

#include <optional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// How two bodies lie to each other. A body in a hollow of another, out of its flesh, is apart.
enum class Meeting { kApart, kCut, kFirstInside, kSecondInside };

/// Least distance between two bodies.
struct Clearance {
  Meeting meeting;
  double distance;          // [m]; 0 unless they are apart
  Vector3 on_first;         // nearest points of the two skins [m]; where the skins cut, a point of the cut
  Vector3 on_second;        // [m]
  Eigen::Index first_face;  // they lie on
  Eigen::Index second_face;
};

/// Exact least distance between two skins, and whether they cut (self_intersections.h says what counts) or a piece of
/// one lies inside the other. Skins that only touch are 0 apart.
///
/// first, second   closed, oriented outwards
Clearance least_clearance(const TriangleMesh& first, const TriangleMesh& second);

/// A point seen from a body.
struct PointClearance {
  double distance;    // [m] to the skin, exact, from inside or outside
  bool inside;        // of the body
  Eigen::Index face;  // the nearest
};

/// The clearances of N points [m] from a body, some microseconds each.
///
/// body   closed, oriented outwards
std::vector<PointClearance> point_clearances(const TriangleMesh& body, const Points& points);

/// The convex hull of points in a plane, as triangles round one of its corners (facing either way).
///
/// points   3 x N [m], in the plane that fits them best
/// flat     how far they may be from it [m]
/// returns  nothing if they are farther, fewer than three, or not wider than a thousandth of their length
std::optional<TriangleMesh> flat_hull(const Points& points, double flat);

/// Where a body meets a plate, or comes too near to it.
struct PlateCollision {
  int plate;
  double distance;    // [m]; 0 if the body goes through the plate or holds it
  Vector3 at;         // nearest point of the plate [m]
  Eigen::Index face;  // nearest of the body
};

/// Whether a body meets one of several flat plates without thickness: the boards that carry a device's transducers. A
/// plate is the convex hull of the points with its number. Some points carry no plate:
///   - fewer than three
///   - points farther than 1 mm from the plane that fits them best (a bowl)
///   - rows not wider than a thousandth of their length
///
/// body        closed, oriented outwards
/// positions   3 x N [m]
/// plates      N plate numbers, in any order
/// clearance   least distance allowed between body and plate [m], >= 0; at 0 it may touch the plate
/// returns     the nearest collision, of equal ones that of the lowest plate; nothing if the body is clear of them all
/// throws      InputError on sizes that do not match, or a clearance that is not >= 0
std::optional<PlateCollision> plate_collision(const TriangleMesh& body, const Points& positions,
                                              const Eigen::VectorXi& plates, double clearance);

}  // namespace touchfield
