#pragma once

#include <limits>
#include <vector>

#include "sim/core/box_tree.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Boxes round the faces of a mesh, each larger by `touch` times the face's longest edge on every side.
std::vector<Box> boxes_round_faces(const TriangleMesh& mesh, double touch);

/// The point of a surface that is nearest to a given one.
struct SkinPoint {
  Eigen::Index face;  // it lies on, -1 if there is none
  Vector3 at;         // [m]
  double distance;    // [m]
};

/// The faces of a mesh in a BoxTree: what is near a point and whether it is inside, in some microseconds on
/// 50,000 faces. Keeps its own copy of the faces. Any number of threads may ask at once.
class FaceTree {
 public:
  explicit FaceTree(const TriangleMesh& mesh);

  /// The nearest point of the surface, exact, among those nearer than `within` [m].
  SkinPoint nearest(const Vector3& x, double within = std::numeric_limits<double>::infinity()) const;

  /// The nearest point of the surface if x lies on it but for rounding, of single precision too. That is no farther
  /// than 1e-4 of the square root of the largest face's area.
  SkinPoint touched(const Vector3& x) const;

  /// The nearest point of the faces whose unit normal n has n . direction >= least_cosine.
  SkinPoint nearest_facing(const Vector3& x, const Vector3& direction, double least_cosine) const;

  /// The faces whose centroid is no farther than `radius` [m] from x, written to `found`.
  void centroids_within(const Vector3& x, double radius, std::vector<Eigen::Index>& found) const;

  /// How often the surface winds round x, off the surface: 1 inside a closed surface with outward normals, 0 outside.
  /// Nothing jumps at edges, and small holes do no harm. Near faces count exactly, groups of faces farther than 2.5 of
  /// their radii by two moments: absolute error below 0.06.
  ///
  /// source   Barill et al., Fast winding numbers for soups and clouds, ACM Trans. Graph. 37 (2018) 43
  double winding_number(const Vector3& x) const;

 private:
  struct Leaf {  // one face
    Vector3 a;
    Vector3 b;
    Vector3 c;
    Vector3 normal;
    Eigen::Index face;
  };
  struct Moments {  // a node's faces seen from far
    Vector3 at;
    Vector3 area;            // [m2], sum of area times normal
    Eigen::Matrix3d spread;  // [m3], sum of area times (centroid - at) normal^T
    double radius;           // [m], no corner is farther from `at`
  };

  Moments moments_of(const TriangleMesh& mesh, const BoxTree::Node& node) const;

  template <class Allowed>
  SkinPoint search(const Vector3& x, double within, const Allowed& allowed) const;

  BoxTree tree_;
  double touch_ = 0;              // [m]
  std::vector<Leaf> leaves_;      // by place
  std::vector<Moments> moments_;  // by node
};

}  // namespace touchfield
