#include "sim/felt/skin_patch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Eigen::Index;

/// The length of the arc over a chord that turns by the angle between two unit normals.
double arc(double chord, const Vector3& n, const Vector3& m) {
  const double half = 0.5 * std::atan2(n.cross(m).norm(), n.dot(m));
  return half > 1e-4 ? chord * half / std::sin(half) : chord;
}

/// The area-weighted normal of the skin about a face: of single faces it is too rough.
Vector3 normal_about(const TriangleMesh& mesh, Index face) {
  constexpr double kAbout = 2e-3;  // [m]
  Vector3 sum = mesh.areas()(face) * mesh.normals().col(face);
  for (Index f = 0; f < mesh.face_count(); ++f) {
    if ((mesh.centroids().col(f) - mesh.centroids().col(face)).norm() < kAbout &&
        mesh.normals().col(f).dot(mesh.normals().col(face)) > kSameSide) {
      sum += mesh.areas()(f) * mesh.normals().col(f);
    }
  }
  return sum.normalized();
}

Eigen::Vector2d laid_flat(const SkinPatch& patch, const Vector3& at, const Vector3& normal) {
  const Vector3 from = at - patch.middle;
  const Eigen::Vector2d seen = patch.axes.leftCols<2>().transpose() * from;
  const double length = seen.norm();
  return length > 0.0 ? Eigen::Vector2d(arc(from.norm(), normal, patch.axes.col(2)) / length * seen)
                      : Eigen::Vector2d::Zero();
}

/// The neighbours of every face across its edges.
std::vector<std::vector<Index>> neighbours(const TriangleMesh& mesh) {
  std::vector<std::vector<Index>> next(static_cast<std::size_t>(mesh.face_count()));
  for_each_edge(sorted_sides(mesh.triangles()), [&](std::span<const Side> sides) {
    for (const Side& a : sides) {
      for (const Side& b : sides) {
        if (a.face != b.face) {
          next[static_cast<std::size_t>(a.face)].push_back(b.face);
        }
      }
    }
  });
  return next;
}

}  // namespace

Eigen::Matrix3d axes_about(const Vector3& normal) {
  const Vector3 towards = std::abs(normal.x()) < 0.9 ? Vector3::UnitX() : Vector3::UnitY();
  Eigen::Matrix3d axes;
  axes.col(0) = (towards - towards.dot(normal) * normal).normalized();
  axes.col(1) = normal.cross(axes.col(0));
  axes.col(2) = normal;
  return axes;
}

SkinPatch skin_patch(const TriangleMesh& mesh, Index face) {
  SkinPatch patch{.face = face,
                  .middle = mesh.centroids().col(face),
                  .axes = axes_about(normal_about(mesh, face)),
                  .faces = {face}};
  const auto next = neighbours(mesh);
  std::vector<Index> number(next.size(), -1);  // among the patch's faces; -2: seen, not of it
  number[static_cast<std::size_t>(face)] = 0;
  for (std::size_t i = 0; i < patch.faces.size(); ++i) {
    for (const Index f : next[static_cast<std::size_t>(patch.faces[i])]) {
      Index& known = number[static_cast<std::size_t>(f)];
      if (known == -1) {
        const bool within = laid_flat(patch, mesh.centroids().col(f), mesh.normals().col(f)).norm() < SkinPatch::kReach;
        known = within ? 0 : -2;
        if (within) {
          patch.faces.push_back(f);
        }
      }
    }
  }
  std::ranges::sort(patch.faces);
  const auto count = static_cast<Index>(patch.faces.size());
  patch.areas = mesh.areas()(patch.faces);
  patch.places.resize(2, count);
  patch.fade.resize(count);
  for (Index i = 0; i < count; ++i) {
    const Index f = patch.faces[static_cast<std::size_t>(i)];
    number[static_cast<std::size_t>(f)] = i;
    patch.places.col(i) = laid_flat(patch, mesh.centroids().col(f), mesh.normals().col(f));
    const double rim = (SkinPatch::kReach - patch.places.col(i).norm()) / SkinPatch::kRim;
    patch.fade(i) = rim < 1.0 ? 0.5 - 0.5 * std::cos(std::numbers::pi * rim) : 1.0;
  }
  std::vector<double> stretch;
  for (Index i = 0; i < count; ++i) {
    const Index f = patch.faces[static_cast<std::size_t>(i)];
    for (const Index g : next[static_cast<std::size_t>(f)]) {
      const Index j = number[static_cast<std::size_t>(g)];
      if (j > i) {
        patch.next.insert(patch.next.end(), {i, j});
        const double along = arc((mesh.centroids().col(f) - mesh.centroids().col(g)).norm(), mesh.normals().col(f),
                                 mesh.normals().col(g));
        stretch.push_back((patch.places.col(i) - patch.places.col(j)).norm() / along - 1.0);
      }
    }
  }
  patch.stretch = Eigen::VectorXd::Map(stretch.data(), static_cast<Index>(stretch.size()));
  return patch;
}

std::optional<Eigen::Vector2d> SkinPatch::place_of(const TriangleMesh& mesh, const Vector3& at) const {
  constexpr double kOff = 2e-3;  // [m]
  Index nearest = 0;
  (mesh.centroids()(Eigen::all, faces).colwise() - at).colwise().squaredNorm().minCoeff(&nearest);
  const Index face = faces[static_cast<std::size_t>(nearest)];
  if ((mesh.centroids().col(face) - at).norm() > std::max(kOff, mesh.local_edge(face))) {
    return std::nullopt;
  }
  const Eigen::Vector2d place = laid_flat(*this, at, mesh.normals().col(face));
  return place.norm() <= kReach ? std::optional(place) : std::nullopt;
}

double flattening_error(const SkinPatch& patch, const Eigen::VectorXd& pressure) {
  double squares = 0.0;
  double weights = 0.0;
  for (Index pair = 0; pair < patch.stretch.size(); ++pair) {
    for (const Index end : {2 * pair, 2 * pair + 1}) {
      const Index i = patch.next[static_cast<std::size_t>(end)];
      const double weight = patch.areas(i) * patch.fade(i) * std::abs(pressure(i));
      squares += weight * patch.stretch(pair) * patch.stretch(pair);
      weights += weight;
    }
  }
  return weights > 0.0 ? std::sqrt(squares / weights) : 0.0;
}

}  // namespace touchfield
