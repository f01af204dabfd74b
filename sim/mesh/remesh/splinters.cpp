#include "sim/mesh/remesh/splinters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "sim/mesh/remesh/edit_mesh.h"

namespace touchfield {

namespace {

constexpr double kTurn = 0.985;  // cosine by which a face that is no splinter may turn

constexpr double kFlat = 1e-9;  // height over longest side; a TriangleMesh refuses 2e-12

class SplinterRemover {
 public:
  SplinterRemover(const TriangleMesh& mesh, const Eigen::VectorXd& thinnest)
      : points_(mesh.vertices()),
        thinnest_(thinnest),
        moved_(Eigen::VectorXd::Zero(mesh.vertex_count())),
        mesh_(mesh.triangles(), mesh.vertex_count()) {}

  /// Whether anything changed.
  bool round() {
    bool changed = false;
    for (int side = 0; side < mesh_.side_count(); ++side) {
      if (mesh_.alive(side) && may_collapse(side)) {
        double& moved = moved_(mesh_.to(side));
        moved = std::max(moved, moved_(mesh_.from(side)) + length(side));
        mesh_.collapse(side);
        changed = true;
      } else if (mesh_.alive(side) && may_flip(side)) {
        for (const int v : mesh_.corners_about(side)) {
          moved_(v) += shape(side).height;
        }
        mesh_.flip(side);
        changed = true;
      }
    }
    return changed;
  }

  TriangleMesh result() const {
    std::vector<int> numbers;
    Triangles triangles = mesh_.compact(numbers);
    return {points_(Eigen::all, numbers), std::move(triangles)};
  }

 private:
  Vector3 point(int v) const { return points_.col(v); }

  struct Shape {
    Vector3 normal;
    double height;  // over the longest side
    bool splinter;
    bool flat;  // no area to speak of
  };

  Shape shape(int a, int b, int c) const {
    const Vector3 twice_area = (point(b) - point(a)).cross(point(c) - point(a));
    const double longest =
        std::max({(point(b) - point(a)).norm(), (point(c) - point(b)).norm(), (point(a) - point(c)).norm()});
    const double height = twice_area.norm() / longest;
    const double least = std::min({thinnest_(a), thinnest_(b), thinnest_(c)});
    return {twice_area.normalized(), height, !(height >= least), !(height > kFlat * longest)};
  }

  Shape shape(int side) const { return shape(mesh_.from(side), mesh_.to(side), mesh_.apex(side)); }

  double length(int side) const { return (point(mesh_.to(side)) - point(mesh_.from(side))).norm(); }

  bool may_collapse(int side) const {
    const int a = mesh_.from(side);
    const int b = mesh_.to(side);
    if (!(moved_(a) + length(side) < std::min(thinnest_(a), thinnest_(b))) || !mesh_.can_collapse(side)) {
      return false;
    }
    for (const int around : mesh_.around(a)) {
      const int c = mesh_.to(around);
      const int d = mesh_.apex(around);
      if (c != b && d != b) {
        const Shape before = shape(around);
        const Shape after = shape(b, c, d);
        if (before.splinter ? after.flat : after.splinter || after.normal.dot(before.normal) < kTurn) {
          return false;
        }
      }
    }
    return !closes_a_thin_part(a, b);
  }

  /// Whether faces about a look against faces about b: the edge then is the thickness of a part.
  bool closes_a_thin_part(int a, int b) const {
    constexpr double kAgainst = -0.5;
    bool found = false;
    for_each_normal(a, [&](const Vector3& n) {
      for_each_normal(b, [&](const Vector3& m) { found = found || n.dot(m) < kAgainst; });
    });
    return found;
  }

  template <class Visit>
  void for_each_normal(int v, const Visit& visit) const {
    for (const int around : mesh_.around(v)) {
      if (const Shape face = shape(around); !face.splinter) {
        visit(face.normal);
      }
    }
  }

  /// Whether the side is the longest of a splinter, and the other diagonal leaves thicker faces in the same plane.
  bool may_flip(int side) const {
    const Shape thin = shape(side);
    if (!thin.splinter || !mesh_.can_flip(side)) {
      return false;
    }
    const auto [a, b, c, d] = mesh_.corners_about(side);
    for (const int v : {a, b, c, d}) {
      if (!(moved_(v) + thin.height < thinnest_(v))) {
        return false;
      }
    }
    if (length(side) < std::max(length(EditMesh::next(side)), length(EditMesh::previous(side)))) {
      return false;
    }
    const Shape other = shape(mesh_.opposite(side));
    const Shape one_after = shape(d, c, a);
    const Shape other_after = shape(c, d, b);
    const auto in_plane = [&](const Shape& after) {
      return after.splinter || other.splinter || after.normal.dot(other.normal) >= kTurn;
    };
    return std::min(one_after.height, other_after.height) > std::min(thin.height, other.height) &&
           in_plane(one_after) && in_plane(other_after);
  }

  const Points& points_;
  const Eigen::VectorXd& thinnest_;
  Eigen::VectorXd moved_;  // how far the surface about each vertex has moved at most
  EditMesh mesh_;
};

}  // namespace

TriangleMesh without_splinters(const TriangleMesh& mesh,
                               const std::function<Eigen::VectorXd(const Points&)>& thinnest) {
  const Eigen::VectorXd least = thinnest(mesh.vertices());
  SplinterRemover remover(mesh, least);
  constexpr int kMostRounds = 20;  // every flip raises a least height; the last few thin faces are not worth more
  for (int i = 0; i < kMostRounds && remover.round(); ++i) {
  }
  return remover.result();
}

}  // namespace touchfield
