#include "sim/body/skin_mesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/remesh/isosurface.h"
#include "sim/mesh/remesh/mean_height.h"
#include "sim/mesh/remesh/remesh.h"

namespace touchfield {

namespace {

/// A regular grid around the body, cut into blocks of kBlock^3 nodes.
class Grid {
 public:
  static constexpr int kBlock = 8;

  Grid(const SoftBody& body, double spacing) : origin_(body.lower().array() - 2.0 * spacing), spacing_(spacing) {
    const Vector3 cells = (body.upper() - body.lower()) / spacing;
    for (int axis = 0; axis < 3; ++axis) {
      blocks_[axis] = static_cast<int>((cells(axis) + 5.0) / kBlock) + 1;
    }
  }

  int blocks() const { return blocks_[0] * blocks_[1] * blocks_[2]; }
  int nodes(int axis) const { return blocks_[axis] * kBlock; }
  const Vector3& origin() const { return origin_; }

  /// Distances at the nodes of one block. Where the body's surface cannot cross it, all get that of its middle.
  void fill(const SoftBody& body, int block, float* distances) const {
    const int first[3] = {block % blocks_[0] * kBlock, block / blocks_[0] % blocks_[1] * kBlock,
                          block / (blocks_[0] * blocks_[1]) * kBlock};
    constexpr double kSteepest = 1.5;  // bound on the gradient of a SoftBody: 1 plus the slope of a plate's radius
    constexpr double kHalf = 0.5 * (kBlock - 1);
    const double middle = body.distance(node(first[0] + kHalf, first[1] + kHalf, first[2] + kHalf));
    const bool crossed = std::abs(middle) <= kSteepest * std::sqrt(3.0) * (kHalf + 1.0) * spacing_;
    for (int k = first[2]; k < first[2] + kBlock; ++k) {
      for (int j = first[1]; j < first[1] + kBlock; ++j) {
        float* row = distances +
                     (static_cast<std::size_t>(k) * static_cast<std::size_t>(nodes(1)) + static_cast<std::size_t>(j)) *
                         static_cast<std::size_t>(nodes(0));
        for (int i = first[0]; i < first[0] + kBlock; ++i) {
          row[i] = off_zero(crossed ? body.distance(node(i, j, k)) : middle);
        }
      }
    }
  }

 private:
  Vector3 node(double i, double j, double k) const { return origin_ + spacing_ * Vector3(i, j, k); }

  /// A node on the surface would make faces without area.
  float off_zero(double distance) const {
    const double least = 1e-3 * spacing_;
    return static_cast<float>(std::abs(distance) < least ? std::copysign(least, distance) : distance);
  }

  Vector3 origin_;
  double spacing_;
  int blocks_[3];
};

Isosurface extract(const SoftBody& body, double spacing) {
  const Grid grid(body, spacing);
  const NodeGrid nodes{grid.origin(), spacing, {grid.nodes(0), grid.nodes(1), grid.nodes(2)}};
  std::vector<float> distances(nodes.size());
#pragma omp parallel for schedule(dynamic)
  for (int block = 0; block < grid.blocks(); ++block) {
    grid.fill(body, block, distances.data());
  }
  return isosurface(nodes, distances);
}

/// The outer surface alone: pieces that enclose a negative volume are cavities.
Isosurface without_cavities(const Isosurface& soup) {
  const auto vertices = static_cast<std::size_t>(soup.points.cols());
  std::vector<int> parent(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    parent[v] = static_cast<int>(v);
  }
  const auto root = [&](int v) {
    while (parent[static_cast<std::size_t>(v)] != v) {
      int& up = parent[static_cast<std::size_t>(v)];
      up = parent[static_cast<std::size_t>(up)];
      v = up;
    }
    return v;
  };
  for (const auto& triangle : soup.triangles.colwise()) {
    parent[static_cast<std::size_t>(root(triangle(1)))] = root(triangle(0));
    parent[static_cast<std::size_t>(root(triangle(2)))] = root(triangle(0));
  }
  std::vector<double> volume(vertices, 0.0);
  const Vector3 origin = soup.points.rowwise().mean();
  for (const auto& triangle : soup.triangles.colwise()) {
    const Vector3 a = soup.points.col(triangle(0)) - origin;
    const Vector3 b = soup.points.col(triangle(1)) - origin;
    const Vector3 c = soup.points.col(triangle(2)) - origin;
    volume[static_cast<std::size_t>(root(triangle(0)))] += a.dot(b.cross(c)) / 6.0;
  }
  const auto bodies = std::count_if(volume.begin(), volume.end(), [](double v) { return v > 0; });
  if (bodies != 1) {
    throw NumericalError(fmt::format("skin: the surface has {} pieces, it must have one", bodies));
  }

  Isosurface outer;
  std::vector<int> number(vertices, -1);
  outer.points.resize(3, soup.points.cols());
  outer.triangles.resize(3, soup.triangles.cols());
  Eigen::Index points = 0;
  Eigen::Index triangles = 0;
  for (const auto& triangle : soup.triangles.colwise()) {
    if (volume[static_cast<std::size_t>(root(triangle(0)))] > 0) {
      for (const int v : {triangle(0), triangle(1), triangle(2)}) {
        if (number[static_cast<std::size_t>(v)] < 0) {
          number[static_cast<std::size_t>(v)] = static_cast<int>(points);
          outer.points.col(points++) = soup.points.col(v);
        }
      }
      outer.triangles.col(triangles++) << number[static_cast<std::size_t>(triangle(0))],
          number[static_cast<std::size_t>(triangle(1))], number[static_cast<std::size_t>(triangle(2))];
    }
  }
  outer.points.conservativeResize(3, points);
  outer.triangles.conservativeResize(3, triangles);
  return outer;
}

/// Mean height of the surface above each face. A quadratic surface through the corners of a face has 3/4 of its height
/// above the centroid as its mean height.
Eigen::VectorXd heights_above(const SoftBody& body, const TriangleMesh& mesh) {
  Eigen::VectorXd heights(mesh.face_count());
#pragma omp parallel for schedule(static)
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    heights(f) = -0.75 * body.distance(mesh.centroids().col(f));
  }
  return heights;
}

}  // namespace

TriangleMesh skin_mesh(const SoftBody& body, const EdgeSizing& sizing, double coarsest_grid) {
  constexpr int kRounds = 8;
  const Isosurface soup = without_cavities(extract(body, std::min(sizing.far(), coarsest_grid)));
  const RemeshTarget target{[&](const Points& points) { return sizing.at(points); },
                            [&](Points& points) { body.project(points, 0.5 * sizing.far()); }};
  const TriangleMesh mesh = remeshed(soup.points, soup.triangles, target, kRounds);
  constexpr double kMostLift = 0.1;  // of the wanted edge
  return with_mean_height_zero(mesh, heights_above(body, mesh), kMostLift * sizing.at(mesh.vertices()));
}

TriangleMesh skin_mesh(const SoftBody& body, double edge, double coarsest_grid) {
  return skin_mesh(body, EdgeSizing(edge), coarsest_grid);
}

}  // namespace touchfield
