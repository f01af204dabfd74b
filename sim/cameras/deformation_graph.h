#pragma once

#include <span>
#include <vector>

#include "sim/mesh/topology.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Points of a skin by the faces they lie on. Any skin of the same faces has them.
struct SkinBinding {
  std::vector<int> face;
  Points weights;  // 3 x P, of the face's corners, 1 in sum
};

/// What the nodes of a graph do to a skin that lies somewhere in space.
struct NodeMotions {
  Points at;                           // 3 x N, of the nodes, undeformed [m]
  std::vector<Eigen::Matrix3d> frame;  // of each node: columns along the skin, along the skin, out of the skin
  Points shift;                        // 3 x N, where the deformation takes them, less `at` [m]
  std::vector<Eigen::Matrix3d> turn;   // of what is round each node
};

/// Where some nodes take a point: sum_k w_k (g_k + t_k + R_k (x - g_k)).
template <class Nodes, class Weights>
Vector3 moved(const NodeMotions& motions, const Nodes& nodes, const Weights& weights, const Vector3& x) {
  Vector3 sum = Vector3::Zero();
  Eigen::Index k = 0;
  for (const int node : nodes) {
    const Vector3 at = motions.at.col(node);
    sum += weights(k++) * (at + motions.shift.col(node) + motions.turn[static_cast<std::size_t>(node)] * (x - at));
  }
  return sum;
}

/// Nodes spread over a skin. Their motions deform whatever is bound to the skin (embedded deformation).
///
/// Nodes are vertices, each the farthest from those before it along the skin, until none is farther than the spacing. A
/// node's cell is the vertices nearer to it than to other nodes. Two nodes are neighbours if their cells share an edge
/// of the mesh. Distances run along the skin, so that fingers that touch do not move each other. A vertex is bound to
/// the four nodes nearest to it, with the weights
///
///   w_k = (1 - d_k / d_5)^2 / sum,   d_k the distance to the k-th of them
///
/// A point on a face is bound to the nodes of the face's corners. Their weights at the corners are averaged by the
/// point's weights of the corners. The point x moves to
///
///   x' = moved(x) above,   R_i = argmin_R sum_j |g_j + t_j - g_i - t_i - R (g_j - g_i)|^2
///
/// g are the nodes' places on the undeformed skin, t their shifts, j the neighbours of i. The turns thus follow from
/// the shifts. Shifts are kept in the frames of the nodes, which move with the skin. On a skin moved rigidly the same
/// shifts are the same deformation, moved rigidly. On a skin in another pose they are the deformation most like it.
///
/// accuracy   shifts of a rigid motion move all points by it, to rounding
/// source     Sumner, Schmid and Pauly, ACM Trans. Graph. 26 (2007) 80; Sorkine and Alexa, Symposium on Geometry
///            Processing 2007 (the turns)
class DeformationGraph {
 public:
  /// mesh      the skin in a pose in which its parts do not touch
  /// spacing   of the nodes [m], > 0
  /// throws    InputError if the spacing is not positive, or leaves fewer than five nodes on a piece of the mesh
  DeformationGraph(const TriangleMesh& mesh, double spacing);

  Eigen::Index node_count() const { return static_cast<Eigen::Index>(nodes_.size()); }
  const std::vector<int>& nodes() const { return nodes_; }  // vertices
  int face_count() const { return static_cast<int>(mesh_.face_count()); }

  std::span<const int> neighbours(Eigen::Index node) const {
    const auto i = static_cast<std::size_t>(node);
    return std::span(neighbours_).subspan(starts_[i], starts_[i + 1] - starts_[i]);
  }

  static constexpr int kNearest = 4;          // nodes to which a vertex is bound
  static constexpr int kMost = 3 * kNearest;  // nodes to which a face is bound

  /// The nodes to which points on a face are bound, and their weights.
  ///
  /// corners   of the face's corners, 1 in sum
  std::span<const int> nodes_of(int face) const {
    const auto f = static_cast<std::size_t>(face);
    return std::span(face_nodes_).subspan(face_starts_[f], face_starts_[f + 1] - face_starts_[f]);
  }
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1> weights_of(int face, const Vector3& corners) const {
    const auto f = static_cast<std::size_t>(face);
    return corner_weights_
               .middleCols(static_cast<Eigen::Index>(face_starts_[f]),
                           static_cast<Eigen::Index>(face_starts_[f + 1] - face_starts_[f]))
               .transpose() *
           corners;
  }

  /// What the shifts do to the skin with its vertices at these places.
  ///
  /// vertices   3 x V, of the constructor's mesh in any pose [m]
  /// shifts     3 x N in the frames of the nodes [m]; empty for none
  /// throws     InputError on other sizes
  NodeMotions motions(const Points& vertices, const Points& shifts) const;

  /// Computes the turns that belong to the shifts.
  void turn(NodeMotions& motions) const;

  /// The shifts in the frames of the nodes.
  static Points shifts(const NodeMotions& motions);

  /// How points that lie on the constructor's mesh, or near it, are bound to it.
  SkinBinding bind(const Points& points) const;

  /// Moves points to where the deformation takes them.
  ///
  /// points   3 x P, those that are bound, where the undeformed skin has them [m]
  void apply(const NodeMotions& motions, const SkinBinding& binding, Points& points) const;

  /// The same of the mesh's own vertices.
  void apply(const NodeMotions& motions, Points& vertices) const;

 private:
  struct Roads;  // along the edges of the mesh

  void choose_nodes(const Roads& roads, double spacing);
  void hang_vertices(const Roads& roads);
  void hang_faces();
  void find_neighbours(const Roads& roads);
  Eigen::Matrix3d frame(const Points& vertices, int vertex) const;

  TriangleMesh mesh_;
  FacesRound round_;
  std::vector<int> nodes_;
  std::vector<int> cell_;          // of each vertex: the node nearest to it
  Eigen::Matrix4Xi vertex_nodes_;  // to which each is bound
  Eigen::Matrix4Xd vertex_weights_;
  std::vector<int> neighbours_;  // of node i: neighbours_[k], starts_[i] <= k < starts_[i + 1], in order
  std::vector<std::size_t> starts_;
  std::vector<int> face_nodes_;  // of face f, likewise, in order
  std::vector<std::size_t> face_starts_;
  Points corner_weights_;  // column k: weights of face_nodes_[k] at the face's corners
};

}  // namespace touchfield
