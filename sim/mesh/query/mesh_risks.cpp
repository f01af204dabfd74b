#include "sim/mesh/query/mesh_risks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void measure_sizes(const TriangleMesh& mesh, const Eigen::VectorXd& sizes, MeshRisks& risks) {
  const EdgeTable edges = edge_table(mesh.triangles());
  const Index count = edges.ends.cols();
  Eigen::VectorXd smallest = Eigen::VectorXd::Constant(count, kInfinity);
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(count);
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (const int e : edges.of_face.col(f)) {
      smallest(e) = std::min(smallest(e), sizes(f));
      largest(e) = std::max(largest(e), sizes(f));
    }
  }
  Index worst = 0;
  risks.size_jump = (largest.array() / smallest.array()).maxCoeff(&worst);
  const auto end = [&](int which, Index e) { return mesh.vertices().col(edges.ends(which, e)); };
  risks.jump_at = 0.5 * (end(0, worst) + end(1, worst));

  double shortest = kInfinity;
  double longest = 0;
  for (Index e = 0; e < count; ++e) {
    const double length = (end(1, e) - end(0, e)).norm();
    shortest = std::min(shortest, length);
    longest = std::max(longest, length);
  }
  risks.size_range = longest / shortest;
}

void measure_angles(const TriangleMesh& mesh, MeshRisks& risks) {
  risks.smallest_angle = kInfinity;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const double angle = corner_angle(mesh, f, c);
      if (angle < risks.smallest_angle) {
        risks.smallest_angle = angle;
        risks.angle_at = mesh.corner(f, c);
      }
    }
  }
}

/// The nearest face that looks at a face, by distance over the face's local edge.
struct Opposite {
  double ratio = kInfinity;
  Index face = -1;

  void consider(double other_ratio, Index other) {
    if (other_ratio < ratio || (other_ratio == ratio && other < face)) {
      ratio = other_ratio;
      face = other;
    }
  }
};

Vector3 midway(const TriangleMesh& mesh, const std::vector<Opposite>& opposites, double& least) {
  const auto worst = std::min_element(opposites.begin(), opposites.end(),
                                      [](const Opposite& o, const Opposite& p) { return o.ratio < p.ratio; });
  least = worst->ratio;
  if (worst->face < 0) {
    return Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return 0.5 * (mesh.centroids().col(worst - opposites.begin()) + mesh.centroids().col(worst->face));
}

void measure_distances(const TriangleMesh& mesh, const Eigen::VectorXd& sizes, MeshRisks& risks) {
  constexpr double kReach = 5.0;  // local edges
  const FaceTree tree(mesh);
  const auto faces = static_cast<std::size_t>(mesh.face_count());
  std::vector<Opposite> through_air(faces);
  std::vector<Opposite> through_body(faces);
#pragma omp parallel
  {
    std::vector<Index> found;
#pragma omp for schedule(dynamic, 64)
    for (Index i = 0; i < mesh.face_count(); ++i) {
      tree.centroids_within(mesh.centroids().col(i), kReach * sizes(i), found);
      for (const Index j : found) {
        // A pair counts once, from its larger face.
        const Facing how = sizes(j) > sizes(i) ? Facing::kNot : facing(mesh, i, j);
        if (how == Facing::kNot) {
          continue;
        }
        const double distance = (mesh.centroids().col(j) - mesh.centroids().col(i)).norm();
        auto& opposites = how == Facing::kThroughAir ? through_air : through_body;
        opposites[static_cast<std::size_t>(i)].consider(distance / sizes(i), j);
      }
    }
  }
  risks.gap_at = midway(mesh, through_air, risks.gap);
  risks.thickness_at = midway(mesh, through_body, risks.thickness);
}

}  // namespace

Facing facing(const TriangleMesh& mesh, Index i, Index j) {
  constexpr double kAgainst = -0.5;  // of the normals: 60 degrees short of opposite
  constexpr double kAlong = 0.5;     // of a normal and the line: 60 degrees
  if (mesh.normals().col(j).dot(mesh.normals().col(i)) >= kAgainst) {
    return Facing::kNot;
  }
  const Vector3 line = mesh.centroids().col(j) - mesh.centroids().col(i);
  const double distance = line.norm();
  const double leaves = line.dot(mesh.normals().col(i));
  const double arrives = -line.dot(mesh.normals().col(j));
  if (std::min(leaves, arrives) > kAlong * distance) {
    return Facing::kThroughAir;
  }
  return std::max(leaves, arrives) < -kAlong * distance ? Facing::kThroughBody : Facing::kNot;
}

MeshRisks mesh_risks(const TriangleMesh& mesh) {
  const Eigen::VectorXd local_edges = (mesh.areas().array() * (4.0 / std::sqrt(3.0))).sqrt();
  MeshRisks risks;
  measure_sizes(mesh, local_edges, risks);
  measure_angles(mesh, risks);
  measure_distances(mesh, local_edges, risks);
  return risks;
}

}  // namespace touchfield
