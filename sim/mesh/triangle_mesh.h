#pragma once

#include <cmath>

#include "sim/core/types.h"

namespace touchfield {

using Triangles = Eigen::Matrix3Xi;

/// A triangulated surface with the geometry that boundary elements need. A value; valid once constructed.
class TriangleMesh {
 public:
  /// vertices    3 x V [m]
  /// triangles   3 x M vertex indices, counter-clockwise seen from the side the normal points to
  /// throws      InputError on no triangle, an index outside 0..V-1, a coordinate that is not finite, or a face whose
  ///             area is below 1e-12 of its longest edge squared; the message counts them and names the first
  TriangleMesh(Points vertices, Triangles triangles);

  const Points& vertices() const { return vertices_; }       // 3 x V [m]
  const Triangles& triangles() const { return triangles_; }  // 3 x M
  const Points& centroids() const { return centroids_; }     // 3 x M [m]
  const Points& normals() const { return normals_; }         // 3 x M, unit length
  const Eigen::VectorXd& areas() const { return areas_; }    // M [m2]

  Eigen::Index vertex_count() const { return vertices_.cols(); }
  Eigen::Index face_count() const { return triangles_.cols(); }

  /// Vertex c (0..2) of face f [m].
  Vector3 corner(Eigen::Index f, int c) const { return vertices_.col(triangles_(c, f)); }

  double total_area() const { return areas_.sum(); }  // [m2]

  /// Side of the equilateral triangle of a face's area [m].
  double local_edge(Eigen::Index f) const { return std::sqrt(areas_(f) * 4.0 / std::sqrt(3.0)); }

  /// Enclosed volume by the divergence theorem [m3]; positive for a closed surface with outward normals.
  double signed_volume() const;

  /// Side of the equilateral triangle of mean area [m]: the edge length by which resolution is counted.
  double mean_edge() const;

 private:
  Points vertices_;
  Triangles triangles_;
  Points centroids_;
  Points normals_;
  Eigen::VectorXd areas_;
};

/// The same mesh moved: x -> rotation x + translation.
TriangleMesh transformed(const TriangleMesh& mesh, const Eigen::Matrix3d& rotation, const Vector3& translation);

/// Edges per wavelength: wavelength [m] over the mean edge. The design's "epw".
double edges_per_wavelength(const TriangleMesh& mesh, double wavelength);

}  // namespace touchfield
