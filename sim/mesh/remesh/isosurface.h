#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The nodes of a regular grid along the axes, numbered with x fastest.
struct NodeGrid {
  Vector3 origin;  // the first node [m]
  double spacing;  // [m]
  std::array<int, 3> count;

  std::size_t size() const { return index(0, 0, count[2]); }
  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(count[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(count[0]) +
           static_cast<std::size_t>(i);
  }
};

/// Vertices on a grid's edges and the triangles between them.
struct Isosurface {
  Points points;  // [m]
  Triangles triangles;
};

/// The surface between a grid's nodes of negative values, which are inside, and the others, by marching cubes. It has a
/// vertex on each edge between the two, where the value interpolates linearly to 0. It is oriented outwards, and closed
/// if the outer nodes are outside. An edge may have four faces on a cell's side that has two nodes inside, diagonally
/// opposite, and two outside.
///
/// values   grid.size(), none of them 0
/// source   Schroeder, Maynard and Geveci, Flying Edges, LDAV 2015, as vtkFlyingEdges3D
Isosurface isosurface(const NodeGrid& grid, const std::vector<float>& values);
Isosurface isosurface(const NodeGrid& grid, const std::vector<signed char>& values);

}  // namespace touchfield
