#pragma once

#include <array>
#include <functional>
#include <vector>

#include "sim/mesh/cut/constrained_delaunay.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A plane, or a sphere but for one point, spread out in the plane without distorting angles: a counter-clockwise loop
/// seen from the side that the caps look to is one in the plane.
struct CapChart {
  std::function<Eigen::Vector2d(const Vector3&)> to_plane;  // of a point of space by the nearest point of the surface
  std::function<Vector3(const Eigen::Vector2d&)> to_space;
  double radius;  // [m], of the sphere; 0 of a plane
};

/// Meshes the regions of a plane or sphere that lie to the left of closed loops. A region may have any number of loops
/// for its rim.
class CapMesh {
 public:
  /// points   3 x V, those of the loops on the surface
  /// loops    as numbers of points, each oriented so that a region lies to its left
  /// throws   InputError if loops cross or touch along an edge, or do not bound regions consistently
  CapMesh(const std::vector<Vector3>& points, const std::vector<std::vector<int>>& loops, CapChart chart);

  /// The region to the left of a loop; regions are numbered from 0.
  int region_of(std::size_t loop) const { return region_of_loop_[loop]; }
  int region_count() const { return region_count_; }

  /// Adds points to regions so that their faces have edges of the wanted length, from the lengths of the rim's edges
  /// gradually to those asked for, and no small angles but those that the rim forces.
  ///
  /// regions   whether each is wanted
  /// edge      wanted length at a point [m], > 0
  void refine(const std::vector<bool>& regions, const std::function<double(const Vector3&)>& edge);

  /// Appends the faces of the wanted regions to `triangles` and the points that were added to them to `points`.
  void append(const std::vector<bool>& regions, std::vector<Vector3>& points,
              std::vector<std::array<int, 3>>& triangles) const;

 private:
  struct RimEdge {
    int from;  // points of the surface
    int to;
    std::size_t loop;
  };
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  void number_regions();
  void measure_rim();
  bool insert(const Eigen::Vector2d& p, int start, const std::function<double(const Vector3&)>& edge);
  void line_rim(const std::vector<bool>& regions, const std::function<double(const Vector3&)>& edge);
  bool split_large_faces(const std::vector<bool>& regions, const std::function<double(const Vector3&)>& edge);
  void smooth();
  int surface_point(int side, int count) const;

  CapChart chart_;
  ConstrainedDelaunay mesh_;
  std::vector<Vector3> places_;               // of the triangulation's points
  std::vector<double> wanted_;                // edge length at each
  std::vector<std::vector<int>> on_surface_;  // the loops' points there
  std::vector<RimEdge> rim_;                  // by run
  std::vector<int> region_;                   // of each face, -1 outside
  std::vector<int> region_of_loop_;
  int region_count_ = 0;
  int first_added_ = 0;
};

}  // namespace touchfield
