#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "sim/mesh/topology.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A part of a surface connected by edges.
struct Piece {
  Eigen::Index face;   // its first
  Eigen::Index faces;  // how many
  double area;         // [m2]
  double volume;       // signed [m3]; of a meaning only if the piece is closed and its faces run the same way round

  /// Its faces lie back to back: the volume is nothing but rounding.
  bool flat() const;
};

struct Pieces {
  std::vector<int> of_face;  // the piece of each face
  std::vector<Piece> list;   // in the order of their first faces
};

/// sides   sorted_sides(triangles)
/// most    edges of more faces connect nothing
Pieces find_pieces(const Points& points, const Triangles& triangles, const std::vector<Side>& sides,
                   std::size_t most = std::numeric_limits<std::size_t>::max());

/// Whether each piece lies inside another one, where no sound from outside reaches it. The outer piece then winds round
/// every face of the inner piece, and no face of one cuts a face of the other. Pieces that overlap are not nested.
///
/// pieces   closed, each consistently oriented, inwards or outwards
std::vector<bool> nested(const Points& points, const Triangles& triangles, const Pieces& pieces);

}  // namespace touchfield
