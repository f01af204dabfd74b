#pragma once

#include <array>
#include <functional>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A surface that a mesh is cut along.
struct CuttingSurface {
  /// Of each vertex: -1 on the kept side, 1 beyond, 0 on the surface.
  std::vector<int> sides;
  /// The point of the surface on the edge from a kept point to one beyond.
  std::function<Vector3(const Vector3& kept, const Vector3& beyond)> crossing;
  /// A vertex nearer to a crossing of one of its edges than this share of the edge moves there.
  double snap;
  /// The same for one that would leave a crease (above 50 degrees) by it.
  double snap_off_crease;
  /// Vertices that may do so.
  std::vector<bool> movable;
};

/// The part of a surface on the kept side, open at the cut.
struct ClippedSurface {
  std::vector<Vector3> points;
  std::vector<std::array<int, 3>> triangles;
};

/// Cuts the faces of a closed mesh along a surface. Faces that lie in the surface are left out.
///
/// Vertices close to the surface move onto it along an edge, so that no new face is thinner than the snap makes
/// necessary. A vertex stays if its move would bend or flatten a face much, or let the cut touch itself. Parts of the
/// kept side may be connected by less than about an edge at a movable vertex. These are separated, by a cut that leaves
/// the surface there for the kept side.
///
/// returns   a surface in which every vertex has one fan of faces and every point is used
/// throws    InputError if the mesh is not closed and oriented
ClippedSurface clipped(const TriangleMesh& mesh, CuttingSurface surface);

std::vector<std::array<int, 3>> as_triples(const Triangles& faces);
TriangleMesh as_mesh(const ClippedSurface& surface);

/// The rims of an open surface, as boundary_loops.
std::vector<std::vector<int>> loops_of(const ClippedSurface& surface);

/// Leaves out the points that no face names; the others keep their order.
void drop_unused_points(ClippedSurface& surface);

}  // namespace touchfield
