#include "sim/cameras/deformation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

#include <Eigen/LU>
#include <Eigen/SVD>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"

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
    require(known(v) >= kFound,
            "deformation graph: {} nodes on the piece of vertex {}, 5 are needed: a smaller spacing gives more",
            known(v), v);
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
  require(vertices.cols() == mesh_.vertex_count() && (shifts.cols() == 0 || shifts.cols() == node_count()),
          "deformation graph: {} vertices and {} shifts, it has {} and {}", vertices.cols(), shifts.cols(),
          mesh_.vertex_count(), node_count());
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

SkinBinding bound(const TriangleMesh& mesh, const Points& points) {
  const FaceTree tree(mesh);
  SkinBinding binding{std::vector<int>(static_cast<std::size_t>(points.cols())), Points(3, points.cols())};
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    const SkinPoint nearest = tree.nearest(points.col(p));
    binding.face[static_cast<std::size_t>(p)] = static_cast<int>(nearest.face);
    binding.weights.col(p) = barycentric(mesh, nearest.face, nearest.at);
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

namespace {

/// u x as a matrix: cross(u) v = u x v.
Eigen::Matrix3d cross(const Vector3& u) {
  Eigen::Matrix3d matrix;
  matrix << 0, -u.z(), u.y(), u.z(), 0, -u.x(), -u.y(), u.x(), 0;
  return matrix;
}

void require_sizes(const DeformationGraph& graph, const SkinTargets& targets, const Points& before,
                   const NodeMotions& motions) {
  const Eigen::Index count = targets.at.cols();
  require(targets.target.cols() == count && targets.normal.cols() == count && targets.weight.size() == count &&
              static_cast<Eigen::Index>(targets.skin.face.size()) == count && targets.skin.weights.cols() == count,
          "deformation: {} points, {} targets, {} normals, {} weights and {} bound points must be as many", count,
          targets.target.cols(), targets.normal.cols(), targets.weight.size(), targets.skin.face.size());
  require(motions.shift.cols() == graph.node_count() && (before.cols() == 0 || before.cols() == graph.node_count()),
          "deformation: {} shifts, {} before, the graph has {} nodes", motions.shift.cols(), before.cols(),
          graph.node_count());
}

}  // namespace

DeformationFit::DeformationFit(DeformationGraph graph) : graph_(std::move(graph)) {
  star_starts_.push_back(0);
  for (int i = 0; i < graph_.node_count(); ++i) {
    stars_.push_back(i);
    stars_.insert(stars_.end(), graph_.neighbours(i).begin(), graph_.neighbours(i).end());
    std::sort(stars_.begin() + static_cast<std::ptrdiff_t>(star_starts_.back()), stars_.end());
    star_starts_.push_back(stars_.size());
  }
  find_pattern();
  solver_.analyzePattern(system_.matrix);
}

void DeformationFit::find_pattern() {
  const auto nodes = static_cast<std::size_t>(graph_.node_count());
  std::vector<std::map<int, int>> columns(nodes);  // row: block
  const auto for_each_pair = [](std::span<const int> group, const auto& visit) {
    for (std::size_t k = 0; k < group.size(); ++k) {
      for (std::size_t l = 0; l <= k; ++l) {
        visit(group[k], static_cast<std::size_t>(group[l]));
      }
    }
  };
  const auto for_each_group = [&](const auto& visit) {
    for (int f = 0; f < graph_.face_count(); ++f) {
      visit(graph_.nodes_of(f), of_faces_);
    }
    for (std::size_t i = 0; i < nodes; ++i) {
      visit(std::span<const int>(stars_).subspan(star_starts_[i], star_starts_[i + 1] - star_starts_[i]), of_stars_);
    }
  };
  for_each_group([&](std::span<const int> group, Pairs&) {
    for_each_pair(group, [&](int row, std::size_t column) { columns[column][row] = 0; });
  });
  std::vector<Eigen::Triplet<double>> entries;
  columns_.push_back(0);
  for (std::size_t j = 0; j < nodes; ++j) {
    for (auto& [row, block] : columns[j]) {
      block = static_cast<int>(rows_.size());
      rows_.push_back(row);
      for (int c = 0; c < 3; ++c) {
        for (int r = 0; r < 3; ++r) {
          entries.emplace_back(3 * row + r, 3 * static_cast<int>(j) + c, 1.0);
        }
      }
    }
    columns_.push_back(rows_.size());
  }
  for_each_group([&](std::span<const int> group, Pairs& pairs) {
    pairs.starts.push_back(pairs.blocks.size());
    for_each_pair(group, [&](int row, std::size_t column) { pairs.blocks.push_back(columns[column][row]); });
  });
  blocks_.resize(9, static_cast<Eigen::Index>(rows_.size()));
  system_.matrix.resize(3 * graph_.node_count(), 3 * graph_.node_count());
  system_.matrix.setFromTriplets(entries.begin(), entries.end());
  system_.gradient.resize(3 * graph_.node_count());
}

void DeformationFit::add_targets(const SkinTargets& targets, const NodeMotions& motions) {
  for (Eigen::Index p = 0; p < targets.at.cols(); ++p) {
    const double weight = targets.weight(p);
    if (weight == 0) {
      continue;
    }
    const int face = targets.skin.face[static_cast<std::size_t>(p)];
    const std::span<const int> nodes = graph_.nodes_of(face);
    const auto weights = graph_.weights_of(face, targets.skin.weights.col(p));
    const Vector3 normal = targets.normal.col(p);
    const double off = normal.dot(moved(motions, nodes, weights, targets.at.col(p)) - targets.target.col(p));
    residual_ += weight * off * off;
    const Eigen::Matrix3d plane = weight * normal * normal.transpose();
    std::size_t pair = of_faces_.starts[static_cast<std::size_t>(face)];
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double share = weights(static_cast<Eigen::Index>(k));
      system_.gradient.segment<3>(3 * static_cast<Eigen::Index>(nodes[k])) += weight * off * share * normal;
      for (std::size_t l = 0; l <= k; ++l) {
        blocks_.col(of_faces_.blocks[pair++]) += share * weights(static_cast<Eigen::Index>(l)) * plane.reshaped();
      }
    }
  }
}

/// With edges a_j = R_i (g_j - g_i), residuals r_j and a turn w on top of R_i each term is |r_j + d_j - d_i + a_j x
/// w|^2. The best turn, w = -M^-1 sum_j A_j^T (d_j - d_i) with A_j v = a_j x v, M = sum_j A_j^T A_j (the residuals of
/// the best R_i have sum_j A_j^T r_j = 0), leaves sum_j |r_j + d_j - d_i|^2 - |sum_j A_j^T (d_j - d_i)|^2_(M^-1).
void DeformationFit::add_edges(double weight, const NodeMotions& motions) {
  std::vector<Eigen::Matrix3d> lever;  // A_j^T of each node of the star
  std::vector<Eigen::Matrix3d> turned;
  for (int i = 0; i < graph_.node_count(); ++i) {
    const std::size_t first = star_starts_[static_cast<std::size_t>(i)];
    const auto star =
        std::span<const int>(stars_).subspan(first, star_starts_[static_cast<std::size_t>(i) + 1] - first);
    lever.assign(star.size(), Eigen::Matrix3d::Zero());
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    const Eigen::Matrix3d& turn = motions.turn[static_cast<std::size_t>(i)];
    std::size_t middle = 0;
    for (std::size_t k = 0; k < star.size(); ++k) {
      const int j = star[k];
      if (j == i) {
        middle = k;
        continue;
      }
      const Vector3 edge = motions.at.col(j) - motions.at.col(i);
      const Vector3 turned_edge = turn * edge;
      const Vector3 off = edge + motions.shift.col(j) - motions.shift.col(i) - turned_edge;
      system_.energy += weight * off.squaredNorm();
      system_.gradient.segment<3>(3 * static_cast<Eigen::Index>(j)) += weight * off;
      system_.gradient.segment<3>(3 * static_cast<Eigen::Index>(i)) -= weight * off;
      lever[k] = -cross(turned_edge);
      sum += lever[k];
      inertia += lever[k] * lever[k].transpose();
    }
    lever[middle] = -sum;
    inertia.diagonal().array() += 1e-9 * inertia.trace();  // neighbours on a line
    const Eigen::Matrix3d inverse = inertia.inverse();
    std::size_t pair = of_stars_.starts[static_cast<std::size_t>(i)];
    for (std::size_t k = 0; k < star.size(); ++k) {
      const Eigen::Matrix3d row = -weight * lever[k].transpose() * inverse;
      for (std::size_t l = 0; l <= k; ++l) {
        Eigen::Matrix3d block = row * lever[l];
        if (k == middle && l == middle) {
          block.diagonal().array() += weight * static_cast<double>(star.size() - 1);
        } else if (k == l) {
          block.diagonal().array() += weight;
        } else if (k == middle || l == middle) {
          block.diagonal().array() -= weight;
        }
        blocks_.col(of_stars_.blocks[pair++]) += block.reshaped();
      }
    }
  }
}

void DeformationFit::add_priors(const DeformationPriors& priors, const Points& before, const NodeMotions& motions) {
  for (Eigen::Index i = 0; i < graph_.node_count(); ++i) {
    const Vector3 shift = motions.shift.col(i);
    Vector3 change = shift;
    if (before.cols() != 0) {
      change -= motions.frame[static_cast<std::size_t>(i)] * before.col(i);
    }
    system_.energy += priors.rest * shift.squaredNorm() + priors.before * change.squaredNorm();
    system_.gradient.segment<3>(3 * i) += priors.rest * shift + priors.before * change;
    // The first block of a column is its diagonal one.
    auto diagonal = blocks_.col(static_cast<Eigen::Index>(columns_[static_cast<std::size_t>(i)])).reshaped(3, 3);
    diagonal.diagonal().array() += priors.rest + priors.before;
  }
}

const DeformationFit::System& DeformationFit::linearise(const SkinTargets& targets, const DeformationPriors& priors,
                                                        const Points& before, const NodeMotions& motions) {
  require_sizes(graph_, targets, before, motions);
  blocks_.setZero();
  system_.gradient.setZero();
  system_.energy = 0;
  residual_ = 0;
  add_targets(targets, motions);
  system_.energy += residual_;
  add_edges(priors.rigid, motions);
  add_priors(priors, before, motions);
  double* value = system_.matrix.valuePtr();
  for (std::size_t j = 0; j + 1 < columns_.size(); ++j) {
    for (Eigen::Index c = 0; c < 3; ++c) {
      for (std::size_t b = columns_[j]; b < columns_[j + 1]; ++b) {
        value = std::copy_n(&blocks_(3 * c, static_cast<Eigen::Index>(b)), 3, value);
      }
    }
  }
  return system_;
}

double DeformationFit::fit(const SkinTargets& targets, const DeformationPriors& priors, const Points& before, int steps,
                           NodeMotions& motions) {
  for (int step = 0; step < steps; ++step) {
    linearise(targets, priors, before, motions);
    if (step == 0) {  // later steps change the matrix by the turns of the second term alone
      solver_.factorize(system_.matrix);
      if (solver_.info() != Eigen::Success) {
        throw NumericalError("deformation: what was seen and the priors leave a node free");
      }
    }
    const Eigen::VectorXd change = solver_.solve(-system_.gradient);
    motions.shift += change.reshaped(3, graph_.node_count());
    graph_.turn(motions);
  }
  const double total = targets.weight.sum();
  return total > 0 ? std::sqrt(residual_ / total) : 0.0;
}

}  // namespace touchfield
