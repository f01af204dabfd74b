#include "sim/cameras/deformation_graph.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <set>
#include <tuple>

#include <Eigen/SVD>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/topology.h"

namespace touchfield {

/// Which vertices the edges of a mesh lead to, and how far.
struct DeformationGraph::Roads {
  struct Road {
    int to;
    double length;  // [m]
  };
  /// Where a walk from a node may go on, the nearest first.
  struct Step {
    double distance;  // from the node [m]
    int vertex;
    int node;

    bool operator>(const Step& other) const {
      return std::tie(distance, vertex, node) > std::tie(other.distance, other.vertex, other.node);
    }
  };
  using Steps = std::priority_queue<Step, std::vector<Step>, std::greater<>>;

  explicit Roads(const TriangleMesh& mesh)
      : edges(edge_table(mesh.triangles()).ends), from(static_cast<std::size_t>(mesh.vertex_count())) {
    for (const auto& edge : edges.colwise()) {
      const double length = (mesh.vertices().col(edge(0)) - mesh.vertices().col(edge(1))).norm();
      from[static_cast<std::size_t>(edge(0))].push_back({edge(1), length});
      from[static_cast<std::size_t>(edge(1))].push_back({edge(0), length});
    }
  }

  /// Goes on from a step to all vertices round it.
  void go_on(const Step& step, Steps& steps) const {
    for (const auto& [to, length] : from[static_cast<std::size_t>(step.vertex)]) {
      steps.push({step.distance + length, to, step.node});
    }
  }

  Eigen::Matrix2Xi edges;
  std::vector<std::vector<Road>> from;
};

DeformationGraph::DeformationGraph(const TriangleMesh& mesh, double spacing)
    : mesh_(mesh), round_(mesh.triangles(), mesh.vertex_count()) {
  require(spacing > 0, "deformation graph: spacing {} m must be positive", spacing);
  const Roads roads(mesh_);
  choose_nodes(roads, spacing);
  hang_vertices(roads);
  hang_faces();
  find_neighbours(roads);
}

void DeformationGraph::choose_nodes(const Roads& roads, double spacing) {
  const auto count = static_cast<std::size_t>(mesh_.vertex_count());
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  for (std::size_t v = 0; v < count; ++v) {
    if (roads.from[v].empty()) {
      distance[v] = 0;  // of no face
    }
  }
  cell_.assign(count, -1);
  while (true) {
    const auto farthest = std::ranges::max_element(distance);
    if (!(*farthest > spacing)) {
      return;
    }
    Roads::Steps steps;
    steps.push({0, static_cast<int>(farthest - distance.begin()), static_cast<int>(nodes_.size())});
    nodes_.push_back(steps.top().vertex);
    while (!steps.empty()) {
      const Roads::Step step = steps.top();
      steps.pop();
      if (const auto v = static_cast<std::size_t>(step.vertex); step.distance < distance[v]) {
        distance[v] = step.distance;
        cell_[v] = step.node;
        roads.go_on(step, steps);
      }
    }
  }
}

void DeformationGraph::hang_vertices(const Roads& roads) {
  constexpr int kFound = kNearest + 1;
  const Eigen::Index count = mesh_.vertex_count();
  Eigen::Matrix<double, kFound, Eigen::Dynamic> distances(kFound, count);
  Eigen::Matrix<int, kFound, Eigen::Dynamic> found(kFound, count);
  Eigen::VectorXi known = Eigen::VectorXi::Zero(count);
  Roads::Steps steps;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    steps.push({0, nodes_[i], static_cast<int>(i)});
  }
  while (!steps.empty()) {
    const Roads::Step step = steps.top();
    steps.pop();
    const Eigen::Index v = step.vertex;
    if (known(v) < kFound && !(found.col(v).head(known(v)).array() == step.node).any()) {
      distances(known(v), v) = step.distance;
      found(known(v)++, v) = step.node;
      roads.go_on(step, steps);
    }
  }
  vertex_nodes_ = Eigen::Matrix4Xi::Zero(kNearest, count);
  vertex_weights_ = Eigen::Matrix4Xd::Zero(kNearest, count);
  for (Eigen::Index v = 0; v < count; ++v) {
    if (roads.from[static_cast<std::size_t>(v)].empty()) {
      continue;
    }
    if (known(v) < kFound) {
      throw InputError(
          fmt::format("deformation graph: {} nodes on the piece of vertex {}, 5 are needed: a smaller "
                      "spacing gives more",
                      known(v), v));
    }
    const Eigen::Array4d near = 1 - distances.col(v).head<kNearest>().array() / distances(kNearest, v);
    vertex_nodes_.col(v) = found.col(v).head<kNearest>();
    vertex_weights_.col(v) = near.square() / near.square().sum();
  }
}

void DeformationGraph::hang_faces() {
  std::vector<Vector3> weights;
  face_starts_.push_back(0);
  for (const auto& face : mesh_.triangles().colwise()) {
    std::set<int> nodes;
    for (const int corner : face) {
      nodes.insert(vertex_nodes_.col(corner).begin(), vertex_nodes_.col(corner).end());
    }
    for (const int node : nodes) {
      Vector3& weight = weights.emplace_back();
      for (int c = 0; c < 3; ++c) {
        weight(c) = (vertex_nodes_.col(face(c)).array() == node).select(vertex_weights_.col(face(c)), 0).sum();
      }
      face_nodes_.push_back(node);
    }
    face_starts_.push_back(face_nodes_.size());
  }
  corner_weights_ = as_columns(weights);
}

void DeformationGraph::find_neighbours(const Roads& roads) {
  std::vector<std::set<int>> round(nodes_.size());
  for (const auto& edge : roads.edges.colwise()) {
    const int a = cell_[static_cast<std::size_t>(edge(0))];
    const int b = cell_[static_cast<std::size_t>(edge(1))];
    if (a != b) {
      round[static_cast<std::size_t>(a)].insert(b);
      round[static_cast<std::size_t>(b)].insert(a);
    }
  }
  starts_.push_back(0);
  for (const std::set<int>& nodes : round) {
    neighbours_.insert(neighbours_.end(), nodes.begin(), nodes.end());
    starts_.push_back(neighbours_.size());
  }
}

Eigen::Matrix3d DeformationGraph::frame(const Points& vertices, int vertex) const {
  Vector3 out = Vector3::Zero();
  for (const Eigen::Index face : round_.of(vertex)) {
    out += twice_area_vector(vertices, mesh_.triangles().col(face));
  }
  out.normalize();
  const Eigen::Vector3i first = mesh_.triangles().col(round_.of(vertex).front());
  const int towards = first(0) == vertex ? first(1) : first(0);
  const Vector3 across = out.cross(vertices.col(towards) - vertices.col(vertex)).normalized();
  Eigen::Matrix3d axes;
  axes << across.cross(out), across, out;
  return axes;
}

NodeMotions DeformationGraph::motions(const Points& vertices, const Points& shifts) const {
  if (vertices.cols() != mesh_.vertex_count() || (shifts.cols() != 0 && shifts.cols() != node_count())) {
    throw InputError(fmt::format("deformation graph: {} vertices and {} shifts, it has {} and {}", vertices.cols(),
                                 shifts.cols(), mesh_.vertex_count(), node_count()));
  }
  NodeMotions motions{Points(3, node_count()), {}, Points::Zero(3, node_count()), {}};
  motions.frame.reserve(nodes_.size());
  for (Eigen::Index i = 0; i < node_count(); ++i) {
    const int vertex = nodes_[static_cast<std::size_t>(i)];
    motions.at.col(i) = vertices.col(vertex);
    motions.frame.push_back(frame(vertices, vertex));
    if (shifts.cols() != 0) {
      motions.shift.col(i) = motions.frame.back() * shifts.col(i);
    }
  }
  motions.turn.resize(nodes_.size());
  turn(motions);
  return motions;
}

void DeformationGraph::turn(NodeMotions& motions) const {
  for (Eigen::Index i = 0; i < node_count(); ++i) {
    Eigen::Matrix3d turned = Eigen::Matrix3d::Zero();
    for (const int j : neighbours(i)) {
      const Vector3 edge = motions.at.col(j) - motions.at.col(i);
      turned += (edge + motions.shift.col(j) - motions.shift.col(i)) * edge.transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(turned, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d u = svd.matrixU();
    if (u.determinant() * svd.matrixV().determinant() < 0) {
      u.col(2) *= -1;
    }
    motions.turn[static_cast<std::size_t>(i)] = u * svd.matrixV().transpose();
  }
}

Points DeformationGraph::shifts(const NodeMotions& motions) {
  Points shifts(3, motions.shift.cols());
  for (Eigen::Index i = 0; i < shifts.cols(); ++i) {
    shifts.col(i) = motions.frame[static_cast<std::size_t>(i)].transpose() * motions.shift.col(i);
  }
  return shifts;
}

SkinBinding DeformationGraph::bind(const Points& points) const {
  const FaceTree tree(mesh_);
  SkinBinding binding{std::vector<int>(static_cast<std::size_t>(points.cols())), Points(3, points.cols())};
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    const SkinPoint nearest = tree.nearest(points.col(p));
    binding.face[static_cast<std::size_t>(p)] = static_cast<int>(nearest.face);
    binding.weights.col(p) = barycentric(mesh_, nearest.face, nearest.at);
  }
  return binding;
}

void DeformationGraph::apply(const NodeMotions& motions, const SkinBinding& binding, Points& points) const {
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    const int face = binding.face[static_cast<std::size_t>(p)];
    points.col(p) = moved(motions, nodes_of(face), weights_of(face, binding.weights.col(p)), points.col(p));
  }
}

void DeformationGraph::apply(const NodeMotions& motions, Points& vertices) const {
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    vertices.col(v) = moved(motions, vertex_nodes_.col(v), vertex_weights_.col(v), vertices.col(v));
  }
}

}  // namespace touchfield
