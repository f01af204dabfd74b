#include "sim/mesh/remesh/surface_remesh.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/creases.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/remesh/remesh.h"

namespace touchfield {

namespace {

constexpr double kFacing = 0.5;  // least cosine between a point's normal and that of the face it is put on

/// Puts points on the original surface. One that would go astray (no face looks its way nearby: the tip of a needle)
/// stays where it was.
void project(const FaceTree& tree, const EdgeSizing& sizing, Points& moved, const Points& before,
             const Points& normals) {
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index i = 0; i < moved.cols(); ++i) {
    const Vector3 x = moved.col(i);
    const SkinPoint skin = tree.nearest_facing(x, normals.col(i), kFacing);
    moved.col(i) = skin.face >= 0 && skin.distance <= sizing.at(x) ? skin.at : Vector3(before.col(i));
  }
}

/// Mean height of the original above each face, by the quadrature that is exact for quadratics.
Eigen::VectorXd heights_above(const FaceTree& tree, const EdgeSizing& sizing, const TriangleMesh& mesh) {
  Eigen::VectorXd heights = Eigen::VectorXd::Zero(mesh.face_count());
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 normal = mesh.normals().col(f);
    for (int c = 0; c < 3; ++c) {
      const Vector3 x = 0.5 * (mesh.corner(f, c) + mesh.centroids().col(f));
      const SkinPoint skin = tree.nearest_facing(x, normal, kFacing);
      if (skin.face >= 0 && skin.distance <= sizing.at(x)) {
        heights(f) += normal.dot(skin.at - x) / 3.0;
      }
    }
  }
  return heights;
}

void require_possible(const TriangleMesh& original, const EdgeSizing& sizing, double crease_angle) {
  constexpr double kMostFaces = 5e6;
  require_closed_surface(original, "remesh");
  require(crease_angle > 0 && crease_angle <= std::numbers::pi,
          "remesh: the crease angle = {} rad must be > 0 and at most pi", crease_angle);
  if (wanted_faces(original, sizing, kMostFaces) >= kMostFaces) {
    const Vector3 size = 1e3 * (original.vertices().rowwise().maxCoeff() - original.vertices().rowwise().minCoeff());
    throw InputError(fmt::format(
        "remesh: edges of {:.4g} to {:.4g} mm on a body of {:.4g} x {:.4g} x {:.4g} mm would make more than "
        "{:.0f} faces",
        1e3 * sizing.finest(), 1e3 * sizing.far(), size.x(), size.y(), size.z(), kMostFaces));
  }
}

void require_same_volume(const TriangleMesh& original, const TriangleMesh& result, const EdgeSizing& sizing) {
  constexpr double kMostChange = 0.1;
  const double change = result.signed_volume() / original.signed_volume() - 1.0;
  if (!(std::abs(change) <= kMostChange)) {
    const FaceTree tree(result);
    Eigen::VectorXd distances(original.face_count());
#pragma omp parallel for schedule(dynamic, 256)
    for (Eigen::Index f = 0; f < original.face_count(); ++f) {
      distances(f) = tree.nearest(original.centroids().col(f)).distance;
    }
    Eigen::Index farthest = 0;
    distances.maxCoeff(&farthest);
    const Vector3 at = original.centroids().col(farthest);
    throw RemeshError(fmt::format("the volume changes by {:.1f} %", 100.0 * change), at, sizing.at(at));
  }
}

/// Without creases and tips in some places.
TriangleMesh remeshed_once(const TriangleMesh& original, const EdgeSizing& sizing, double crease_angle,
                           const std::vector<Ball>& smooth) {
  constexpr int kRounds = 10;
  constexpr double kThinnest = 0.03;  // of the wanted edge
  constexpr double kMostLift = 0.1;   // of the wanted edge
  const auto wanted = [&](const Points& points) { return sizing.at(points); };
  const TriangleMesh start =
      without_splinters(original, [&](const Points& points) { return Eigen::VectorXd(kThinnest * sizing.at(points)); });
  const FaceTree tree(original);
  const std::vector<int> tips = find_tips(start, wanted, smooth);
  const CreasedTarget target{wanted,
                             [&](Points& moved, const Points& before, const Points& normals) {
                               project(tree, sizing, moved, before, normals);
                             },
                             find_creases(start, crease_angle, wanted, tips, smooth), tips};
  const auto [mesh, held] = remeshed(start.vertices(), start.triangles(), target, kRounds);
  Eigen::VectorXd most = kMostLift * sizing.at(mesh.vertices());
  for (std::size_t v = 0; v < held.size(); ++v) {
    if (held[v] != 0) {
      most(static_cast<Eigen::Index>(v)) = 0;
    }
  }
  return with_mean_height_zero(mesh, heights_above(tree, sizing, mesh), most);
}

/// Where faces of the result are next to flat, or cut each other although none of the original do.
std::vector<Vector3> faults(const TriangleMesh& result, const TriangleMesh& original) {
  constexpr double kLeastAngle = 0.5 / 180.0 * std::numbers::pi;
  std::vector<Vector3> places;
  const Eigen::VectorXd angles = smallest_angles(result);
  for (Eigen::Index f = 0; f < result.face_count(); ++f) {
    if (angles(f) < kLeastAngle) {
      places.emplace_back(result.centroids().col(f));
    }
  }
  const auto pairs = self_intersections(result);
  if (!pairs.empty() && self_intersections(original, 1).empty()) {
    for (const auto& [face, other] : pairs) {
      places.emplace_back(result.centroids().col(face));
    }
  }
  return places;
}

}  // namespace

TriangleMesh remeshed_surface(const TriangleMesh& original, const EdgeSizing& sizing, double crease_angle) {
  require_possible(original, sizing, crease_angle);
  constexpr int kMostAttempts = 6;
  constexpr double kReach = 2.0;  // wanted edges
  std::vector<Ball> smooth;
  EdgeSizing used = sizing;
  std::optional<RemeshError> first_error;
  for (int attempt = 1;; ++attempt) {
    std::optional<TriangleMesh> result;
    std::vector<Vector3> places;
    try {
      result = remeshed_once(original, used, crease_angle, smooth);
      places = faults(*result, original);
    } catch (const RemeshError& error) {
      first_error = first_error.value_or(error);
      places.push_back(error.at());
    }
    const bool last = attempt == kMostAttempts;
    if (result && (last || places.empty())) {
      require_same_volume(original, *result, sizing);
      return *std::move(result);
    }
    if (last) {
      throw RemeshError(*first_error);
    }
    // A crease too small for the edges holds vertices that should go. Where there is none, shorter edges help.
    std::vector<SizingZone> zones = used.zones();
    const auto before = std::ssize(smooth);
    for (const Vector3& at : places) {
      if (std::any_of(smooth.begin() + before, smooth.end(), [&](const Ball& ball) { return ball.holds(at); })) {
        continue;
      }
      const double edge = sizing.at(at);
      smooth.push_back({at, kReach * attempt * edge});
      if (attempt > 1) {
        zones.push_back({at, std::max(0.125, std::pow(0.5, attempt - 1)) * edge, edge});
      }
    }
    used = EdgeSizing(sizing.far(), std::move(zones), sizing.growth());
  }
}

VertexMeans::VertexMeans(const TriangleMesh& mesh)
    : normals(Points::Zero(3, mesh.vertex_count())), areas(Eigen::VectorXd::Zero(mesh.vertex_count())) {
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (const int v : mesh.triangles().col(f)) {
      normals.col(v) += mesh.areas()(f) * mesh.normals().col(f);
      areas(v) += mesh.areas()(f);
    }
  }
  normals.colwise().normalize();
}

TriangleMesh with_mean_height_zero(const TriangleMesh& mesh, const Eigen::VectorXd& heights,
                                   const Eigen::VectorXd& most) {
  const VertexMeans means(mesh);
  Eigen::VectorXd lift = Eigen::VectorXd::Zero(mesh.vertex_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (const int v : mesh.triangles().col(f)) {
      lift(v) += mesh.areas()(f) * heights(f);
    }
  }
  Points vertices = mesh.vertices();
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    vertices.col(v) += std::clamp(lift(v) / means.areas(v), -most(v), most(v)) * means.normals.col(v);
  }
  return {vertices, mesh.triangles()};
}

}  // namespace touchfield
