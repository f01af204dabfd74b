#pragma once

#include <vector>

#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// A body given as meshes of the same triangles at several times, each file of them once in memory (24 bytes per
/// vertex). The state is its vertices, so that what predicts linearly in a Trajectory's state does so here.
class MeshSequence {
 public:
  /// shape    with a series
  /// throws   InputError that names the file, its time and what differs from the first file: how many vertices, how
  ///          many triangles, or the first triangle with other corners; if all files take more than half of the memory
  ///          that is free, before the second is read; if a mesh is not closed or inside out; also as read_mesh
  explicit MeshSequence(const MeshShape& shape);

  const Triangles& triangles() const { return triangles_; }

  /// Vertices at a time of the motion in the files' own frame [m]. They are linear in time between two meshes. Before
  /// the first mesh they are those of the first, after the last mesh those of the last.
  Points state(double seconds) const;

 private:
  /// Of the file at a time, by the time's number.
  const Points& vertices_at(std::size_t time) const { return vertices_[file_at_[time]]; }

  Triangles triangles_;
  std::vector<double> times_;
  std::vector<std::size_t> file_at_;  // of each time the number of its file
  std::vector<Points> vertices_;      // of each file
};

}  // namespace touchfield
