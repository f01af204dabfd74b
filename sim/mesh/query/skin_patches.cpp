#include "sim/mesh/query/skin_patches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "sim/mesh/face_shape.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

}  // namespace

Points SkinPatches::centres() const {
  Points centres(3, size());
  for (Index j = 0; j < size(); ++j) {
    centres.col(j) = corners.middleCols<3>(3 * j).rowwise().mean();
  }
  return centres;
}

Points SkinPatches::normals() const {
  Points normals(3, size());
  for (Index j = 0; j < size(); ++j) {
    const auto patch = corners.middleCols<3>(3 * j);
    const Vector3 ab = patch.col(1) - patch.col(0);
    const Vector3 ac = patch.col(2) - patch.col(0);
    normals.col(j) = ab.cross(ac).normalized();
  }
  return normals;
}

TriangleMesh SkinPatches::mesh() const {
  Triangles triangles(3, size());
  for (Index j = 0; j < size(); ++j) {
    const int first = 3 * static_cast<int>(j);
    triangles.col(j) << first, first + 1, first + 2;
  }
  return {corners, std::move(triangles)};
}

SkinPatches pieces_of(const TriangleMesh& mesh, double longest, int owner) {
  std::vector<Index> cuts(static_cast<std::size_t>(mesh.face_count()));
  Index count = 0;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    const auto n = std::max<Index>(1, static_cast<Index>(std::ceil(longest_edge(mesh, f) / longest)));
    cuts[static_cast<std::size_t>(f)] = n;
    count += n * n;
  }
  SkinPatches pieces{Points(3, 3 * count), Eigen::VectorXd(count), Eigen::VectorXd(count),
                     std::vector<int>(static_cast<std::size_t>(count), owner)};
  Index at = 0;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    const Index n = cuts[static_cast<std::size_t>(f)];
    const auto parts = static_cast<double>(n);
    const Vector3 u = (mesh.corner(f, 1) - mesh.corner(f, 0)) / parts;
    const Vector3 v = (mesh.corner(f, 2) - mesh.corner(f, 0)) / parts;
    const auto point = [&](Index i, Index k) -> Vector3 {
      return mesh.corner(f, 0) + static_cast<double>(i) * u + static_cast<double>(k) * v;
    };
    const auto add = [&](const Vector3& a, const Vector3& b, const Vector3& c) {
      pieces.corners.middleCols<3>(3 * at) << a, b, c;
      pieces.areas(at) = mesh.areas()(f) / (parts * parts);
      pieces.faces(at) = 1.0 / (parts * parts);
      ++at;
    };
    for (Index i = 0; i < n; ++i) {
      for (Index k = 0; i + k < n; ++k) {
        add(point(i, k), point(i + 1, k), point(i, k + 1));
        if (i + k + 1 < n) {
          add(point(i + 1, k + 1), point(i, k + 1), point(i + 1, k));
        }
      }
    }
  }
  return pieces;
}

SkinPatches picked(const SkinPatches& patches, const std::function<bool(Eigen::Index)>& keep) {
  std::vector<Index> kept;
  for (Index j = 0; j < patches.size(); ++j) {
    if (keep(j)) {
      kept.push_back(j);
    }
  }
  const auto count = static_cast<Index>(kept.size());
  SkinPatches result{Points(3, 3 * count), patches.areas(kept), patches.faces(kept), {}};
  for (Index j = 0; j < count; ++j) {
    const Index from = kept[static_cast<std::size_t>(j)];
    result.corners.middleCols<3>(3 * j) = patches.corners.middleCols<3>(3 * from);
    result.owner.push_back(patches.owner[static_cast<std::size_t>(from)]);
  }
  return result;
}

void append(const SkinPatches& more, SkinPatches& patches) {
  const Index before = patches.size();
  patches.corners.conservativeResize(3, 3 * (before + more.size()));
  patches.areas.conservativeResize(before + more.size());
  patches.faces.conservativeResize(before + more.size());
  patches.corners.rightCols(3 * more.size()) = more.corners;
  patches.areas.tail(more.size()) = more.areas;
  patches.faces.tail(more.size()) = more.faces;
  patches.owner.insert(patches.owner.end(), more.owner.begin(), more.owner.end());
}

SkinPatches spread(const SkinPatches& pieces, double apart, Eigen::Index least) {
  const Points centres = pieces.centres();
  const Index count = pieces.size();
  std::vector<Index> taken;
  Eigen::VectorXd square = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity());  // of distances
  std::vector<std::size_t> nearest(static_cast<std::size_t>(count), 0);
  Index next = 0;
  while (static_cast<Index>(taken.size()) < count &&
         (static_cast<Index>(taken.size()) < least || square(next) > apart * apart)) {
    const Vector3 x = centres.col(next);
    const std::size_t number = taken.size();
    taken.push_back(next);
    for (Index i = 0; i < count; ++i) {
      const double distance = (centres.col(i) - x).squaredNorm();
      if (distance < square(i)) {
        square(i) = distance;
        nearest[static_cast<std::size_t>(i)] = number;
      }
    }
    square.maxCoeff(&next);
  }
  std::vector<Index> place(static_cast<std::size_t>(count), -1);  // of a piece that was taken, among these in order
  for (const Index piece : taken) {
    place[static_cast<std::size_t>(piece)] = 0;
  }
  SkinPatches patches = picked(pieces, [&](Index i) { return place[static_cast<std::size_t>(i)] == 0; });
  Index size = 0;
  for (Index& at : place) {
    at = at == 0 ? size++ : at;
  }
  patches.areas.setZero();
  patches.faces.setZero();
  for (Index i = 0; i < count; ++i) {
    const Index j = place[static_cast<std::size_t>(taken[nearest[static_cast<std::size_t>(i)]])];
    patches.areas(j) += pieces.areas(i);
    patches.faces(j) += pieces.faces(i);
  }
  return patches;
}

}  // namespace touchfield
