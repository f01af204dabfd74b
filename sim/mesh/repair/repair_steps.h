#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "sim/mesh/query/pieces.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A surface under repair: points [m] and triangles of three distinct points each.
struct RawSurface {
  Points points;
  Triangles triangles;
};

inline std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// The steps of a repair. Each changes the surface and adds a line that says what it did, or does neither.
using StepLog = std::vector<std::string>;

/// "12.3 mm2" of an area [m2].
std::string area_text(double area);

/// What was dropped, for a line of the log.
struct Dropped {
  std::ptrdiff_t pieces = 0;
  std::string faces;  // "5 faces"
  std::string area;   // "12.3 mm2"
  std::string place;  // of the first
};

/// Drops the pieces that are marked.
Dropped drop_pieces(RawSurface& surface, const Pieces& pieces, const std::vector<bool>& marked);

/// Drops patches (parts connected by edges of two faces) that hang on edges of more faces: those with an open rim whose
/// area is below `share` of the largest patch's, and those without one all of whose faces are `copied`.
///
/// copied   of each face: whether the file has it in both directions; kept in step with the triangles
void drop_flaps(RawSurface& surface, std::vector<bool>& copied, double share, StepLog& log);

/// Drops pieces (parts connected by edges) whose area is below `share` of the largest one's.
void drop_stray_pieces(RawSurface& surface, double share, StepLog& log);

/// Turns faces so that the two at each edge run opposite ways, in each piece as most of its faces ran.
/// Edges of more than two faces connect nothing. What is not orientable keeps misoriented edges.
void make_consistent(RawSurface& surface, StepLog& log);

/// Fills the holes that are no longer than `limit` [m] round, and those wholly in what is unwanted.
///
/// unwanted  whether a point will be cut off; may be empty
/// surface   edge-manifold and consistently oriented
/// returns   a line for each of the first holes left
std::vector<std::string> fill_small_holes(RawSurface& surface, double limit, StepLog& log,
                                          const std::function<bool(const Vector3&)>& unwanted = {});

/// Gives each fan of faces at a vertex a vertex of its own, moved towards the fan's rim.
void split_pinched_vertices(RawSurface& surface, StepLog& log);

/// Flips or collapses faces with next to no area.
///
/// surface   closed, manifold, consistently oriented
void remove_slivers(RawSurface& surface, StepLog& log);

/// Turns pieces of negative volume, then drops those inside another.
///
/// surface   as for remove_slivers
void turn_outwards(RawSurface& surface, StepLog& log);

/// Cuts out faces that cut each other, with the faces round them, and fills the holes; gives up without a change where
/// that takes more than 3 % of the area or more than three rounds, or the surface falls apart into pieces that are not
/// below `share` of the largest one's area.
///
/// surface   closed, manifold, oriented outwards, without flat faces
void cut_out_crossings(RawSurface& surface, double share, StepLog& log);

}  // namespace touchfield
