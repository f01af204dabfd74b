#include "sim/mesh/cut/constrained_delaunay.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

__extension__ using Wide = __int128;

constexpr std::int64_t kGrid = std::int64_t{1} << 27U;

[[noreturn]] void fail_crossing() {
  throw InputError("mesh: the edges of a cut cross or touch each other: the surface cuts itself there");
}

}  // namespace

ConstrainedDelaunay::ConstrainedDelaunay(const Eigen::Vector2d& lower, const Eigen::Vector2d& upper)
    : lower_(lower), scale_(static_cast<double>(kGrid) / std::max((upper - lower).maxCoeff(), 1e-300)) {
  points_ = {{-3 * kGrid, -kGrid}, {4 * kGrid, -kGrid}, {kGrid / 2, 4 * kGrid}};
  sides_ = {{0}, {1}, {2}};
  leaving_ = {0, 1, 2};
}

/// Twice the area of a triangle, positive if it runs counter-clockwise.
std::int64_t ConstrainedDelaunay::turn(const Place& a, const Place& b, const Place& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool ConstrainedDelaunay::holds(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d on_grid = (p - lower_) * scale_;
  return on_grid.minCoeff() > -1 && on_grid.maxCoeff() < static_cast<double>(kGrid + 1);
}

ConstrainedDelaunay::Place ConstrainedDelaunay::place_of(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d on_grid = (p - lower_) * scale_;
  if (!holds(p)) {
    throw InputError("mesh: a point of a cut is outside of its box");
  }
  return {std::llround(on_grid.x()), std::llround(on_grid.y())};
}

bool ConstrainedDelaunay::in_circle(int face, const Place& p) const {
  std::array<Wide, 3> x;
  std::array<Wide, 3> y;
  std::array<Wide, 3> square;
  for (int i = 0; i < 3; ++i) {
    const Place& corner = place(from(3 * face + i));
    x[at(i)] = corner.x - p.x;
    y[at(i)] = corner.y - p.y;
    square[at(i)] = x[at(i)] * x[at(i)] + y[at(i)] * y[at(i)];
  }
  return square[0] * (x[1] * y[2] - x[2] * y[1]) + square[1] * (x[2] * y[0] - x[0] * y[2]) +
             square[2] * (x[0] * y[1] - x[1] * y[0]) >
         0;
}

/// The face that holds a place, its sides included: walks towards it, and if that leads nowhere looks at all.
int ConstrainedDelaunay::holder(const Place& p, int face) const {
  const auto side_before = [&](int candidate) {
    for (int side = 3 * candidate; side < 3 * candidate + 3; ++side) {
      if (turn(place(from(side)), place(to(side)), p) < 0) {
        return side;
      }
    }
    return -1;
  };
  for (int steps = 0; steps < side_count(); ++steps) {
    const int side = side_before(face);
    if (side < 0) {
      return face;
    }
    face = twin(side) / 3;
  }
  face = 0;
  while (side_before(face) >= 0) {
    ++face;
  }
  return face;
}

int ConstrainedDelaunay::add(const Eigen::Vector2d& p) {
  const Place target = place_of(p);
  const int face = holder(target, last_);
  for (int side = 3 * face; side < 3 * face + 3; ++side) {
    if (place(from(side)) == target) {
      return from(side);
    }
  }
  for (int side = 3 * face; side < 3 * face + 3; ++side) {
    if (turn(place(from(side)), place(to(side)), target) == 0) {
      return insert_on_side(target, side);
    }
  }
  return insert_in_face(target, face);
}

/// Gives a side the neighbour, the run and the fixture that another side had.
void ConstrainedDelaunay::join(int side, const Side& old, int old_side) {
  Side& self = sides_[at(side)];
  self.twin = old.twin;
  self.run = old.run;
  self.fixed = old.fixed;
  if (old.twin >= 0 && side != old_side) {
    sides_[at(old.twin)].twin = side;
  }
}

void ConstrainedDelaunay::pair(int side, int other) {
  sides_[at(side)].twin = other;
  sides_[at(other)].twin = side;
}

/// (a b c) becomes (a b p), (b c p), (c a p).
int ConstrainedDelaunay::insert_in_face(const Place& p, int face) {
  const int m = point_count();
  const int ab = 3 * face;
  const std::array<Side, 3> old = {sides_[at(ab)], sides_[at(ab + 1)], sides_[at(ab + 2)]};
  const int bc = side_count();
  const int ca = bc + 3;
  points_.push_back(p);
  sides_.resize(sides_.size() + 6);
  sides_[at(ab + 1)] = {old[1].from};
  sides_[at(ab + 2)] = {m};
  sides_[at(bc)] = {old[1].from};
  sides_[at(bc + 1)] = {old[2].from};
  sides_[at(bc + 2)] = {m};
  sides_[at(ca)] = {old[2].from};
  sides_[at(ca + 1)] = {old[0].from};
  sides_[at(ca + 2)] = {m};
  join(bc, old[1], ab + 1);
  join(ca, old[2], ab + 2);
  pair(ab + 1, bc + 2);
  pair(bc + 1, ca + 2);
  pair(ca + 1, ab + 2);
  leaving_.push_back(ab + 2);
  leaving_[at(old[0].from)] = ab;
  leaving_[at(old[1].from)] = bc;
  leaving_[at(old[2].from)] = ca;
  last_ = face;
  std::vector<int> sides = {ab, bc, ca};
  legalize(sides);
  return m;
}

/// (a b c), (b a d) become (a p c), (p b c), (b p d), (p a d).
int ConstrainedDelaunay::insert_on_side(const Place& p, int side) {
  if (fixed(side)) {
    fail_crossing();
  }
  const int m = point_count();
  const int other = twin(side);
  const int a = from(side);
  const int b = from(other);
  const int c = from(previous(side));
  const int d = from(previous(other));
  const Side to_c = sides_[at(next(side))];
  const Side to_d = sides_[at(next(other))];
  const int old_to_c = next(side);
  const int old_to_d = next(other);
  const int half = side_count();
  const int other_half = half + 3;
  points_.push_back(p);
  sides_.resize(sides_.size() + 6);
  sides_[at(old_to_c)] = {m};
  sides_[at(old_to_d)] = {m};
  sides_[at(half)] = {m};
  sides_[at(half + 1)] = {b};
  sides_[at(half + 2)] = {c};
  sides_[at(other_half)] = {m};
  sides_[at(other_half + 1)] = {a};
  sides_[at(other_half + 2)] = {d};
  join(half + 1, to_c, old_to_c);
  join(other_half + 1, to_d, old_to_d);
  pair(side, other_half);
  pair(half, other);
  pair(old_to_c, half + 2);
  pair(old_to_d, other_half + 2);
  leaving_.push_back(half);
  leaving_[at(a)] = side;
  leaving_[at(b)] = other;
  leaving_[at(c)] = half + 2;
  leaving_[at(d)] = other_half + 2;
  last_ = side / 3;
  std::vector<int> sides = {previous(side), half + 1, previous(other), other_half + 1};
  legalize(sides);
  return m;
}

/// (a b c), (b a d) become (a d c), (b c d).
void ConstrainedDelaunay::flip(int side) {
  const int other = twin(side);
  const int c = from(previous(side));
  const int d = from(previous(other));
  const Side b_to_c = sides_[at(next(side))];
  const Side a_to_d = sides_[at(next(other))];
  join(side, a_to_d, next(other));
  join(other, b_to_c, next(side));
  sides_[at(next(side))] = {d};
  sides_[at(next(other))] = {c};
  pair(next(side), next(other));
  leaving_[at(from(side))] = side;
  leaving_[at(from(other))] = other;
  leaving_[at(c)] = previous(side);
  leaving_[at(d)] = previous(other);
}

/// Whether the two faces of a side form a strictly convex quadrangle.
bool ConstrainedDelaunay::can_flip(int side) const {
  const int other = twin(side);
  const int c = from(previous(side));
  const int d = from(previous(other));
  return turn(from(side), d, c) > 0 && turn(d, from(other), c) > 0;
}

/// Flips sides, and then those about them, until none can be flipped for the better.
void ConstrainedDelaunay::legalize(std::vector<int>& sides) {
  while (!sides.empty()) {
    const int side = sides.back();
    sides.pop_back();
    const int other = twin(side);
    if (other < 0 || fixed(side) || !in_circle(side / 3, place(from(previous(other)))) || !can_flip(side)) {
      continue;
    }
    flip(side);
    sides.insert(sides.end(), {side, previous(side), other, previous(other)});
  }
}

int ConstrainedDelaunay::side_between(int a, int b) const {
  const int first = first_around(a);
  int side = first;
  do {
    if (to(side) == b) {
      return side;
    }
    side = next_clockwise(side);
  } while (side != first);
  return -1;
}

/// The side that faces a, on the way from a to b.
int ConstrainedDelaunay::first_crossed(int a, int b) const {
  const int first = first_around(a);
  int side = first;
  do {
    const int right = to(side);
    const int left = from(previous(side));
    const std::int64_t right_turn = turn(a, right, b);
    const bool ahead = (place(right).x - place(a).x) * (place(b).x - place(a).x) +
                           (place(right).y - place(a).y) * (place(b).y - place(a).y) >
                       0;
    if (right_turn == 0 && ahead) {
      fail_crossing();
    }
    if (right_turn > 0 && turn(a, left, b) < 0) {
      return next(side);
    }
    side = next_clockwise(side);
  } while (side != first);
  fail_crossing();
}

/// Flips what lies across the segment from a to b until it is an edge.
void ConstrainedDelaunay::clear_way(int a, int b) {
  std::deque<std::pair<int, int>> crossing;
  for (int side = first_crossed(a, b);;) {
    if (fixed(side)) {
      fail_crossing();
    }
    crossing.emplace_back(from(side), to(side));
    const int beyond = twin(side);
    const int apex = from(previous(beyond));
    if (apex == b) {
      break;
    }
    const std::int64_t side_of_apex = turn(a, b, apex);
    if (side_of_apex == 0) {
      fail_crossing();
    }
    side = side_of_apex > 0 ? next(beyond) : previous(beyond);
  }
  std::vector<std::pair<int, int>> changed;
  while (!crossing.empty()) {
    const auto [p, q] = crossing.front();
    crossing.pop_front();
    const int side = side_between(p, q);
    if (!can_flip(side)) {
      crossing.emplace_back(p, q);
      continue;
    }
    flip(side);
    const int c = from(next(side));
    const int d = to(next(side));
    const bool crosses = c != a && c != b && d != a && d != b && (turn(a, b, c) > 0) != (turn(a, b, d) > 0);
    (crosses ? crossing.emplace_back(c, d) : changed.emplace_back(c, d));
  }
  // The edge itself is among the changed ones and must not be flipped away again.
  const int way = side_between(a, b);
  sides_[at(way)].fixed = true;
  sides_[at(twin(way))].fixed = true;
  for (const auto& [p, q] : changed) {
    std::vector<int> sides = {side_between(p, q)};
    if (sides[0] >= 0) {
      legalize(sides);
    }
  }
}

void ConstrainedDelaunay::fix(int a, int b, int run) {
  if (a == b) {
    throw InputError("mesh: an edge of a cut is too short");
  }
  if (side_between(a, b) < 0) {
    clear_way(a, b);
  }
  Side& side = sides_[at(side_between(a, b))];
  if (side.run >= 0) {
    fail_crossing();
  }
  side.fixed = true;
  side.run = run;
  sides_[at(side.twin)].fixed = true;
}

int ConstrainedDelaunay::face_of(const Eigen::Vector2d& p, int start) const {
  const Place target = place_of(p);
  int face = start;
  for (int steps = 0; steps < side_count(); ++steps) {
    int out = -1;
    for (int side = 3 * face; side < 3 * face + 3 && out < 0; ++side) {
      out = turn(place(from(side)), place(to(side)), target) < 0 ? side : -1;
    }
    if (out < 0) {
      return face;
    }
    if (fixed(out)) {
      return -1;
    }
    face = twin(out) / 3;
  }
  return -1;
}

std::vector<int> ConstrainedDelaunay::cavity(const Eigen::Vector2d& p, int start) const {
  const Place target = place_of(p);
  std::vector<int> faces = {start};
  for (std::size_t i = 0; i < faces.size(); ++i) {
    for (int side = 3 * faces[i]; side < 3 * faces[i] + 3; ++side) {
      const int beyond = twin(side) / 3;
      if (twin(side) >= 0 && !fixed(side) && std::find(faces.begin(), faces.end(), beyond) == faces.end() &&
          in_circle(beyond, target)) {
        faces.push_back(beyond);
      }
    }
  }
  return faces;
}

bool ConstrainedDelaunay::move(int point, const Eigen::Vector2d& p) {
  const Place target = place_of(p);
  const int first = first_around(point);
  int side = first;
  do {
    if (turn(target, place(to(side)), place(from(previous(side)))) <= 0) {
      return false;
    }
    side = next_clockwise(side);
  } while (side != first);
  points_[at(point)] = target;
  return true;
}

void ConstrainedDelaunay::restore() {
  std::vector<int> sides;
  for (int side = 0; side < side_count(); ++side) {
    sides.push_back(side);
  }
  legalize(sides);
}

}  // namespace touchfield
