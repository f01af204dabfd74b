#include "sim/hand/skin_mesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/isosurface.h"
#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

/// The body's surface on a grid about it. Of blocks that it cannot cross all nodes get the distance of the middle.
Isosurface extract(const SoftBody& body, double spacing) {
  constexpr int kBlock = 8;          // nodes along a side
  constexpr double kSteepest = 1.5;  // bound on the gradient of a SoftBody: 1 plus the slope of a plate's radius
  constexpr double kHalf = 0.5 * (kBlock - 1);
  const double reach = kSteepest * std::sqrt(3.0) * (kHalf + 1.0) * spacing;
  const Vector3 cells = (body.upper() - body.lower()) / spacing;
  NodeGrid grid{body.lower().array() - 2.0 * spacing, spacing, {}};
  for (int axis = 0; axis < 3; ++axis) {
    grid.count[static_cast<std::size_t>(axis)] = (static_cast<int>((cells(axis) + 5.0) / kBlock) + 1) * kBlock;
  }
  const auto node = [&](double i, double j, double k) -> Vector3 { return grid.origin + spacing * Vector3(i, j, k); };
  // A node on the surface would make faces without area.
  const auto off_zero = [least = 1e-3 * spacing](double distance) {
    return static_cast<float>(std::abs(distance) < least ? std::copysign(least, distance) : distance);
  };
  std::vector<float> distances(grid.size());
  const auto fill_block = [&](int i0, int j0, int k0) {
    const double middle = body.distance(node(i0 + kHalf, j0 + kHalf, k0 + kHalf));
    const bool crossed = std::abs(middle) <= reach;
    for (int k = k0; k < k0 + kBlock; ++k) {
      for (int j = j0; j < j0 + kBlock; ++j) {
        for (int i = i0; i < i0 + kBlock; ++i) {
          distances[grid.index(i, j, k)] = off_zero(crossed ? body.distance(node(i, j, k)) : middle);
        }
      }
    }
  };
#pragma omp parallel for collapse(3) schedule(dynamic)
  for (int k = 0; k < grid.count[2]; k += kBlock) {
    for (int j = 0; j < grid.count[1]; j += kBlock) {
      for (int i = 0; i < grid.count[0]; i += kBlock) {
        fill_block(i, j, k);
      }
    }
  }
  return isosurface(grid, distances);
}

/// The outer surface alone: pieces that enclose a negative volume are cavities.
Isosurface without_cavities(const Isosurface& soup) {
  const Pieces pieces = find_pieces(soup.points, soup.triangles, sorted_sides(soup.triangles));
  const auto is_body = [](const Piece& piece) { return piece.volume > 0; };
  if (const auto bodies = std::ranges::count_if(pieces.list, is_body); bodies != 1) {
    throw NumericalError(fmt::format("skin: the surface has {} pieces, it must have one", bodies));
  }
  Isosurface outer;
  outer.triangles = faces_where(soup.triangles, [&](Eigen::Index f) {
    return is_body(pieces.list[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])]);
  });
  std::vector<int> used;  // the points in the order in which the faces name them
  std::vector<int> number(static_cast<std::size_t>(soup.points.cols()), -1);
  for (int& v : outer.triangles.reshaped()) {
    int& own = number[static_cast<std::size_t>(v)];
    if (own < 0) {
      own = static_cast<int>(used.size());
      used.push_back(v);
    }
    v = own;
  }
  outer.points = soup.points(Eigen::all, used);
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

/// How far it is from a point of the skin through the body (side -1) or the air (1) to the next skin, `most` if that is
/// farther.
double room(const SoftBody& body, const Vector3& x, double side, double most) {
  constexpr double kFirst = 0.1;       // of `most`
  constexpr double kWide = 0.5;        // of `most`: the distance there from skin that is surely farther
  constexpr double kStep = 0.7;        // of the distance: the function's slope may exceed 1
  constexpr double kLeastStep = 0.03;  // of `most`
  const Vector3 way = side * body.at(x).gradient.normalized();
  if (side * body.distance(x + most * way) > kWide * most) {
    return most;
  }
  double reach = kFirst * most;
  while (reach < most) {
    const double distance = side * body.distance(x + reach * way);
    if (distance <= 0) {
      return reach;
    }
    reach += std::max(kStep * distance, kLeastStep * most);
  }
  return most;
}

/// The edges asked for, none longer than the thickness of the body and the width of its clefts allow.
Eigen::VectorXd possible_edges(const SoftBody& body, const EdgeSizing& sizing, const Points& points) {
  Eigen::VectorXd edges = sizing.at(points);
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    for (const double side : {-1.0, 1.0}) {
      if (edges(i) > kAlwaysPossible) {
        const double enough = edges(i) / kOfRoom;
        if (const double there = room(body, points.col(i), side, enough); there < enough) {
          edges(i) = std::max(kOfRoom * there, kAlwaysPossible);
        }
      }
    }
  }
  return edges;
}

}  // namespace

TriangleMesh skin_mesh(const SoftBody& body, const EdgeSizing& sizing, double coarsest_grid) {
  constexpr int kRounds = 8;
  const Isosurface soup = without_cavities(extract(body, std::min(sizing.far(), coarsest_grid)));
  const RemeshTarget target{[&](const Points& points) { return possible_edges(body, sizing, points); },
                            [&](Points& points) { body.project(points, 0.5 * sizing.far()); }};
  const TriangleMesh mesh = remeshed(soup.points, soup.triangles, target, kRounds);
  constexpr double kMostLift = 0.1;  // of the wanted edge
  return with_mean_height_zero(mesh, heights_above(body, mesh),
                               kMostLift * possible_edges(body, sizing, mesh.vertices()));
}

TriangleMesh skin_mesh(const SoftBody& body, double edge, double coarsest_grid) {
  return skin_mesh(body, EdgeSizing(edge), coarsest_grid);
}

}  // namespace touchfield
