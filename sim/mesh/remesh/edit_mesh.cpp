#include "sim/mesh/remesh/edit_mesh.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/topology.h"

namespace touchfield {

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
    if (edge.size() != 2 || edge[0].upwards == edge[1].upwards) {
      throw InputError(
          fmt::format("mesh: the edge between vertices {} and {} must have two faces that run opposite ways",
                      edge[0].low, edge[0].high));
    }
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

}  // namespace touchfield
