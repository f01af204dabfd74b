#pragma once

#include <span>
#include <vector>

#include <Eigen/SparseCholesky>

#include "sim/mesh/topology.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Points of a skin by the faces they lie on. Any skin of the same faces has them.
struct SkinBinding {
  std::vector<int> face;
  Points weights;  // 3 x P, of the face's corners, 1 in sum
};

/// How points that lie on a mesh, or near it, are bound to it.
SkinBinding bound(const TriangleMesh& mesh, const Points& points);

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

/// Planes that points of a skin should come to.
struct SkinTargets {
  SkinBinding skin;        // which points
  Points at;               // 3 x P, where the undeformed skin has them [m]
  Points target;           // 3 x P, a point of the plane [m]
  Points normal;           // 3 x P, unit
  Eigen::VectorXd weight;  // P, >= 0
};

/// What holds a deformation where nothing is seen, and against noise. Each is the weight of a term as if it were so
/// many targets of weight 1.
struct DeformationPriors {
  double rigid = 1.0;    // each edge of the graph turns with its nodes
  double rest = 0.02;    // each node stays on the undeformed skin
  double before = 0.05;  // each node moves as it did before
};

/// Deforms a skin towards what was seen, by Gauss-Newton steps on
///
///   E = sum_p w_p (n_p . (x'_p - q_p))^2 + a sum_i sum_j |g_j + t_j - g_i - t_i - R_i (g_j - g_i)|^2
///       + b sum_i |t_i|^2 + c sum_i |t_i - s_i|^2
///
/// x'_p, g, t, R and the neighbours j of i are as in DeformationGraph. a, b, c are the priors, s the shifts of before.
/// The unknowns of a step are the shifts. The turns of the second term are eliminated from it exactly. Those within x'
/// are taken from before the step. All steps of a call use the matrix of the first.
///
/// accuracy   some calls on targets that moved rigidly reach them to rounding, also where nothing is seen, if b = c =
///            0. A bump of 2 mm (12 mm to its slope), nodes 14 mm apart, three cameras with 0.36 mm of noise: within
///            0.25 mm rms where it is, of 0.94 mm. Two steps on 2,400 targets take 1.4 ms at 150 nodes, 3.0 ms at 255,
///            on one core
/// source     Sumner, Schmid and Pauly 2007; Sorkine and Alexa 2007
class DeformationFit {
 public:
  explicit DeformationFit(DeformationGraph graph);

  const DeformationGraph& graph() const { return graph_; }

  /// E at some motions, and what a step would solve: matrix d = -gradient.
  struct System {
    double energy;                       // [m2]
    Eigen::SparseMatrix<double> matrix;  // 3N x 3N, the lower half; half of the second derivative
    Eigen::VectorXd gradient;            // 3N; half of dE / dt with the turns held
  };

  /// before   shifts in the frames of the nodes (3 x N [m]); empty for none
  /// throws   InputError on sizes that do not match
  const System& linearise(const SkinTargets& targets, const DeformationPriors& priors, const Points& before,
                          const NodeMotions& motions);

  /// Improves the motions.
  ///
  /// returns  rms of n . (x' - q) by weight, before the last step [m]; 0 without targets
  /// throws   InputError as linearise does, NumericalError if the priors leave a node free
  double fit(const SkinTargets& targets, const DeformationPriors& priors, const Points& before, int steps,
             NodeMotions& motions);

 private:
  void find_pattern();
  void add_targets(const SkinTargets& targets, const NodeMotions& motions);
  void add_edges(double weight, const NodeMotions& motions);
  void add_priors(const DeformationPriors& priors, const Points& before, const NodeMotions& motions);

  DeformationGraph graph_;
  System system_;
  double residual_ = 0;  // of the targets: sum of squares by weight [m2]
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  // Half of the second derivative in blocks of 3 x 3, by column and then row.
  std::vector<std::size_t> columns_;  // blocks of column j: columns_[j] <= b < columns_[j + 1]
  std::vector<int> rows_;             // of each block
  Eigen::Matrix<double, 9, Eigen::Dynamic> blocks_;
  // The blocks of all pairs k >= l of some nodes, (0, 0), (1, 0), (1, 1), (2, 0) ...
  struct Pairs {
    std::vector<int> blocks;
    std::vector<std::size_t> starts;
  };
  Pairs of_faces_;  // nodes_of a face
  Pairs of_stars_;  // a node and its neighbours
  std::vector<int> stars_;
  std::vector<std::size_t> star_starts_;
};

}  // namespace touchfield
