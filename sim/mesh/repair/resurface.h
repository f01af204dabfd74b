#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Distances of the points of one surface from another [m]. The points are the middles of its faces, cut until none has
/// an edge longer than the skin's, weighted by area.
struct SurfaceDistance {
  double counted = 0;            // share of the surface's area whose points were asked for, 0..1
  double most_of_it = 0;         // 95 % of that area is nearer
  double farthest = 0;           // at the points asked
  Vector3 at = Vector3::Zero();  // the farthest point [m]
};

/// A surface with new faces.
struct Resurfaced {
  TriangleMesh mesh;      // the new skin
  TriangleMesh original;  // the faces that it was made of, see oriented_soup.h
  /// From the original's outer faces to the skin, and back. Outer is what has w < 0.3 before it and w > 0.7 behind it:
  /// faces inside the body, flaps and the rims of holes are not.
  SurfaceDistance to_skin;
  SurfaceDistance from_skin;              // all of the skin: over a hole there is no original
  std::optional<double> original_volume;  // [m3], where every edge has two faces; overlaps count twice
  std::vector<std::string> steps;         // what was done, a line each, with the figures above
};

/// Refuses, before anything large is begun, an edge too short for the memory and the faces that are allowed.
///
/// throws   InputError if the edge is not > 0 and finite, or the grid would have more than 300 million nodes (0.3 GiB)
///          or the surface more than 5 million faces
void require_resurfaceable(const FileSurface& surface, double unit, double edge, const std::string& name,
                           const std::string& field);

/// One closed skin from any soup of faces: holes, flaps, crossings, duplicates, nested and overlapping parts. A point
/// is inside where the generalised winding number
///
///   w(x) = sum over faces of their solid angle seen from x, signed, over 4 pi
///
/// is above 1/2. It is 1 in a closed surface. It is 2 where two surfaces overlap, so that these become one volume.
/// Holes are closed by the surface w = 1/2 through their rims, a flat hole by about its plane. w is computed on a grid
/// of half the edge (inside_grid.h). Its surface is remeshed to the edge (surface_remesh.h) without creases. Edges
/// sharper than the new faces are rounded by about a quarter of an edge. Cavities and pieces inside others are filled.
/// Gaps narrower than half an edge to an edge close, and parts thinner than that vanish. Pieces smaller than a cube of
/// the edge vanish too.
///
/// surface    as read
/// unit       metres per file unit, > 0
/// edge       of the new faces [m]
/// name       how messages call the surface, e.g. its file
/// field      how messages call the edge, e.g. "--resurface"
/// returns    the skin: closed, manifold, oriented outwards, without faces that cut each other; edges of the length
///            asked for as remeshing makes them
/// throws     InputError as require_resurfaceable, before memory is taken; if there is no volume; if the edge is too
///            long: nothing is left, or 5 % of the outer faces are farther than an edge from the skin
///            NumericalError if the resulting skin cuts itself
/// source     Jacobson, Kavan and Sorkine-Hornung, Robust inside-outside segmentation using generalized winding
///            numbers, ACM Trans. Graph. 32 (2013) 33; face_tree.h computes w
Resurfaced resurfaced(const FileSurface& surface, double unit, double edge, const std::string& name,
                      const std::string& field);

}  // namespace touchfield
