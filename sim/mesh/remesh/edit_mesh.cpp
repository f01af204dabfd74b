#include "sim/mesh/remesh/edit_mesh.h"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>

#include "sim/core/require.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

/// Exchanges the flat face's longest edge for the other diagonal, if that leaves two faces with area.
bool flip_away(EditMesh& mesh, const Points& points, int longest, double least) {
  const auto [a, b, c, d] = mesh.corners_about(longest);
  if (!mesh.can_flip(longest) || is_flat(points, {d, c, a}, least) || is_flat(points, {c, d, b}, least)) {
    return false;
  }
  mesh.flip(longest);
  return true;
}

bool collapse_away(EditMesh& mesh, int shortest) {
  for (const int side : {shortest, mesh.opposite(shortest)}) {
    if (mesh.can_collapse(side)) {
      mesh.collapse(side);
      return true;
    }
  }
  return false;
}

bool remove_flat_face(EditMesh& mesh, const Points& points, int first_side, double least) {
  std::array<int, 3> sides = {first_side, first_side + 1, first_side + 2};
  const auto side_length = [&](int side) { return (points.col(mesh.to(side)) - points.col(mesh.from(side))).norm(); };
  std::sort(sides.begin(), sides.end(), [&](int s, int t) { return side_length(s) < side_length(t); });
  // A needle's ends may become one: the skin moves by its short side. Others move nothing by a flip.
  constexpr double kNeedle = 1e-3;
  if (side_length(sides[0]) <= kNeedle * side_length(sides[2]) && collapse_away(mesh, sides[0])) {
    return true;
  }
  return flip_away(mesh, points, sides[2], least);
}

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

EditMesh::EditMesh(const Triangles& triangles, Eigen::Index vertex_count)
    : from_(static_cast<std::size_t>(triangles.size())),
      opposite_(from_.size(), -1),
      outgoing_(static_cast<std::size_t>(vertex_count), -1),
      valence_(outgoing_.size(), 0),
      labels_(from_.size(), kNoLabel) {
  for (int number = 0; number < side_count(); ++number) {
    const int start = triangles(number % 3, number / 3);
    from_[at(number)] = start;
    outgoing_[at(start)] = number;
    ++valence_[at(start)];
  }
  for_each_edge(sorted_sides(triangles), [&](std::span<const Side> edge) {
    require(edge.size() == 2 && edge[0].upwards != edge[1].upwards,
            "mesh: the edge between vertices {} and {} must have two faces that run opposite ways", edge[0].low,
            edge[0].high);
    join(edge[0].number(), edge[1].number());
  });
}

void EditMesh::join(int side, int other) {
  opposite_[at(side)] = other;
  opposite_[at(other)] = side;
}

int EditMesh::add_face(int a, int b, int c) {
  const int first = side_count();
  from_.insert(from_.end(), {a, b, c});
  opposite_.insert(opposite_.end(), {-1, -1, -1});
  labels_.insert(labels_.end(), {kNoLabel, kNoLabel, kNoLabel});
  return first;
}

int EditMesh::side_between(int a, int b) const {
  for (const int side : around(a)) {
    if (to(side) == b) {
      return side;
    }
  }
  return -1;
}

int EditMesh::split(int side) {
  const int other = opposite(side);
  const int a = from(side);
  const int b = from(other);
  const int c = apex(side);
  const int d = apex(other);
  const int m = vertex_count();
  outgoing_.push_back(-1);
  valence_.push_back(4);

  // (a b c) becomes (a m c) and (m b c), (b a d) becomes (b m d) and (m a d).
  const int behind = opposite(next(side));
  const int other_behind = opposite(next(other));
  const int split_label = label(side);
  const int half = add_face(m, b, c);
  const int other_half = add_face(m, a, d);
  from_[at(next(side))] = m;
  from_[at(next(other))] = m;
  join(next(half), behind);
  join(previous(half), next(side));
  join(next(other_half), other_behind);
  join(previous(other_half), next(other));
  join(side, other_half);
  join(half, other);
  set_label(side, split_label);
  set_label(half, split_label);
  set_label(next(half), label(behind));
  set_label(next(other_half), label(other_behind));
  set_label(next(side), kNoLabel);
  set_label(next(other), kNoLabel);

  outgoing_[at(m)] = half;
  outgoing_[at(a)] = side;
  outgoing_[at(b)] = other;
  ++valence_[at(c)];
  ++valence_[at(d)];
  return m;
}

bool EditMesh::can_collapse(int side) const {
  const int a = from(side);
  const int b = to(side);
  const int c = apex(side);
  const int d = apex(opposite(side));
  if (c == d || valence(c) <= 3 || valence(d) <= 3) {
    return false;
  }
  for (const int leaving : around(a)) {
    const int neighbour = to(leaving);
    if (neighbour != b && neighbour != c && neighbour != d && adjacent(neighbour, b)) {
      return false;
    }
  }
  return true;
}

void EditMesh::collapse(int side) {
  const int other = opposite(side);
  const int a = from(side);
  const int b = to(side);
  const int c = apex(side);
  const int d = apex(other);
  for (int side_of_a = side; from(side_of_a) == a;) {
    const int following = next_around(side_of_a);
    from_[at(side_of_a)] = b;
    side_of_a = following;
  }

  const int b_to_c = opposite(previous(side));  // left a
  const int c_to_b = opposite(next(side));
  const int d_to_b = opposite(next(other));  // led to a
  const int b_to_d = opposite(previous(other));
  join(b_to_c, c_to_b);
  join(d_to_b, b_to_d);
  set_label(b_to_c, std::max(label(b_to_c), label(c_to_b)));
  set_label(d_to_b, std::max(label(d_to_b), label(b_to_d)));
  for (const int gone : {side, next(side), previous(side), other, next(other), previous(other)}) {
    from_[at(gone)] = -1;
  }
  outgoing_[at(a)] = -1;
  outgoing_[at(b)] = b_to_c;
  outgoing_[at(c)] = c_to_b;
  outgoing_[at(d)] = d_to_b;
  valence_[at(b)] += valence_[at(a)] - 4;
  --valence_[at(c)];
  --valence_[at(d)];
}

bool EditMesh::can_flip(int side) const {
  const int c = apex(side);
  const int d = apex(opposite(side));
  return c != d && valence(from(side)) > 3 && valence(to(side)) > 3 && !adjacent(c, d);
}

void EditMesh::flip(int side) {
  const int other = opposite(side);
  const int a = from(side);
  const int b = from(other);
  const int c = apex(side);
  const int d = apex(other);

  // (a b c), (b a d) become (d c a), (c d b).
  const int beyond_bc = opposite(next(side));
  const int beyond_ca = opposite(previous(side));
  const int beyond_ad = opposite(next(other));
  const int beyond_db = opposite(previous(other));
  from_[at(side)] = d;
  from_[at(next(side))] = c;
  from_[at(previous(side))] = a;
  from_[at(other)] = c;
  from_[at(next(other))] = d;
  from_[at(previous(other))] = b;
  join(next(side), beyond_ca);
  join(previous(side), beyond_ad);
  join(next(other), beyond_db);
  join(previous(other), beyond_bc);
  set_label(side, kNoLabel);
  for (const int moved : {next(side), previous(side), next(other), previous(other)}) {
    set_label(moved, label(opposite(moved)));
  }

  outgoing_[at(a)] = previous(side);
  outgoing_[at(b)] = previous(other);
  outgoing_[at(c)] = other;
  outgoing_[at(d)] = side;
  --valence_[at(a)];
  --valence_[at(b)];
  ++valence_[at(c)];
  ++valence_[at(d)];
}

Triangles EditMesh::compact(std::vector<int>& old_numbers) const {
  std::vector<int> new_numbers(outgoing_.size(), -1);
  old_numbers.clear();
  for (int v = 0; v < vertex_count(); ++v) {
    if (vertex_alive(v)) {
      new_numbers[at(v)] = static_cast<int>(old_numbers.size());
      old_numbers.push_back(v);
    }
  }
  Triangles triangles(3, side_count() / 3);
  Eigen::Index count = 0;
  for (int side = 0; side < side_count(); side += 3) {
    if (alive(side)) {
      triangles.col(count++) << new_numbers[at(from(side))], new_numbers[at(from(side + 1))],
          new_numbers[at(from(side + 2))];
    }
  }
  triangles.conservativeResize(3, count);
  return triangles;
}

FlatFaces remove_flat_faces(EditMesh& mesh, const Points& points, double least) {
  FlatFaces result;
  constexpr int kRounds = 20;  // neighbours in a row of flat faces wait for each other
  bool changed = true;
  for (int round = 0; round < kRounds && changed; ++round) {
    changed = false;
    for (int side = 0; side < mesh.side_count(); side += 3) {
      if (!mesh.alive(side) || !is_flat(points, {mesh.from(side), mesh.to(side), mesh.apex(side)}, least)) {
        continue;
      }
      const Vector3 place = points.col(mesh.from(side));
      if (remove_flat_face(mesh, points, side, least)) {
        result.first = result.removed++ == 0 ? place : result.first;
        changed = true;
      }
    }
  }
  return result;
}

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
