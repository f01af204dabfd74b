#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// How far a repair may go.
struct RepairOptions {
  std::optional<double> weld;  // points no farther apart become one [m], >= 0; by default 0 if that leaves no fault,
                               // else 1e-5 of the surface's diagonal, but at most a hundredth of the median edge and a
                               // tenth of the shortest edge of faces that are no needles
  std::optional<double> hole;  // the longest way round a hole that is filled [m], >= 0; by default a tenth of the
                               // surface's diagonal
  std::function<bool(const Vector3&)>
      unwanted;         // points that will be cut off: a hole wholly there is filled however long
  double stray = 0.01;  // pieces below this share of the largest one's area are dropped, 0 to 1
};

struct Repaired {
  TriangleMesh mesh;
  std::vector<std::string> steps;  // what was done, a line each with counts; empty if there was nothing to do
};

/// Makes a closed, manifold, outwardly oriented surface that does not cut itself of a file's surface. In this order:
///
/// 1. points that coincide are welded, points that no face names, faces without three corners and duplicates dropped;
/// 2. flaps are dropped: small open patches, and walls doubled in the file, that hang on edges of three faces or more;
/// 3. stray pieces are dropped;
/// 4. the faces of each piece are made to run the same way round as most of its faces do;
/// 5. holes are filled;
/// 6. where parts touch in one point each gets a point of its own, a hundredth of its shortest edge away;
/// 7. slivers without area are flipped away, or collapsed if they are needles;
/// 8. pieces are turned outwards, and those inside another dropped, for no sound reaches them;
/// 9. a few faces that cut each other (with their neighbours below 3 % of the area) are cut out and the holes filled.
///
/// What a step does not need to touch stays as it is, to the bit. Of a surface without a fault only stray pieces are
/// dropped. What is dropped is said with its area.
///
/// surface   as read
/// unit      metres per file unit, > 0
/// name      how messages call the surface, e.g. its file
/// throws    InputError that names count and place of everything that is left: a surface that is not orientable, edges
///           of three faces or more, holes above the limit, faces that cut each other; or on an option out of range
Repaired repaired(const FileSurface& surface, double unit, const RepairOptions& options, const std::string& name);

/// The mesh of a file that is a closed surface already. Points with equal coordinates are merged; faces with two
/// corners in one point are left out, and those without area (as TriangleMesh counts them) flipped or collapsed away,
/// with everything that is next to as flat. A surface without such faces stays as it is, to the bit.
///
/// surface   as read
/// unit      metres per file unit, > 0
/// name      the file, for messages
/// throws    InputError that names what is left: holes and the like, faces without area that nothing removes
Repaired closed_mesh(const FileSurface& surface, double unit, const std::string& name);

}  // namespace touchfield
