#pragma once

#include <cstddef>
#include <string>
#include <vector>

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

/// Drops pieces (parts connected by edges) whose area is below a hundredth of the largest one's.
void drop_stray_pieces(RawSurface& surface, StepLog& log);

/// Turns faces so that the two at each edge run opposite ways, in each piece as most of its faces ran.
/// Edges of more than two faces connect nothing. What is not orientable keeps misoriented edges.
void make_consistent(RawSurface& surface, StepLog& log);

/// Flips or collapses faces with next to no area.
///
/// surface   closed, manifold, consistently oriented
void remove_slivers(RawSurface& surface, StepLog& log);

/// Turns pieces of negative volume, then drops those inside another.
///
/// surface   as for remove_slivers
void turn_outwards(RawSurface& surface, StepLog& log);

}  // namespace touchfield
