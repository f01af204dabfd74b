#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/mesh/cut/clip_mesh.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// How much a cut may move the skin for the sake of its faces' shapes.
struct CutCare {
  double snap;             // as of CuttingSurface
  double snap_off_crease;  // the same
  bool mends;              // whether thin faces are removed
};

/// Result of clipping and capping: closed, the skin's faces first.
struct CappedCut {
  ClippedSurface surface;
  Eigen::Index skin_faces;
};

/// A closed surface in two parts, a skin and its caps, which meet in rims.
struct CappedSurface {
  Points points;
  Triangles triangles;
  std::vector<bool> is_cap;    // of each face
  std::vector<bool> is_fixed;  // of each point: stays
  /// How far a point of a crease or of a bend of the rim may move at a place [m].
  std::function<double(const Vector3&)> tolerance;
};

/// Removes faces with angles below 25 degrees by collapsing and flipping edges, as far as possible.
///
/// Points of rims and creases (above 50 degrees) move along these where they are nearly straight. Elsewhere they move
/// by less than the tolerance. No face turns by more than 37 degrees, or 73 degrees where a point moves by less than
/// 0.2 of the longest edge at it. A change must increase the smallest angle of the faces that it changes, with one
/// exception. Edges below 0.15 of the longest edge at their ends are collapsed first, if more than half of the smallest
/// angle remains. Angles count up to 25 degrees.
///
/// throws   InputError if the surface is not a closed oriented manifold
void remove_thin_faces(CappedSurface& surface);

/// What a capped cut is judged and mended by.
struct CutPlace {
  std::string what;                                 // how errors call the cut
  std::function<bool(const Vector3&)> is_near;      // whether a face there may have been changed by the cut
  std::function<bool(const Vector3&)> may_change;   // whether a point of the skin may move
  std::function<double(const Vector3&)> tolerance;  // as of CappedSurface
};

/// The first of several cuts, each with less care for shapes, that is closed and does not cut itself near the cut.
///
/// throws   InputError of the last one if there is none
TriangleMesh first_sound_cut(const std::vector<CutCare>& cares, const CutPlace& place,
                             const std::function<CappedCut(const CutCare&)>& cut);

}  // namespace touchfield
