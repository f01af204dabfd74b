#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace touchfield {

/// Triangulation of points of a plane in which given edges stay, Delaunay otherwise. Every decision is exact:
/// coordinates are rounded to a grid of 2^-27 of the box, and points in one place of the grid are one.
///
/// Sides 3 f, 3 f + 1, 3 f + 2 go counter-clockwise round face f. Points 0, 1 and 2 are corners of a triangle far
/// outside of the box; the faces at them belong to nothing.
class ConstrainedDelaunay {
 public:
  /// lower, upper   a box that holds all points
  ConstrainedDelaunay(const Eigen::Vector2d& lower, const Eigen::Vector2d& upper);

  /// The number of a point, new or not.
  /// throws   InputError if it is outside of the box
  int add(const Eigen::Vector2d& p);

  /// Makes two points the ends of an edge that stays; `run` >= 0 is noted on its side from a to b.
  ///
  /// throws   InputError if the edge crosses or covers another one that stays, or passes through a point
  void fix(int a, int b, int run);

  int side_count() const { return static_cast<int>(sides_.size()); }
  int point_count() const { return static_cast<int>(points_.size()); }
  static int next(int side) { return side % 3 == 2 ? side - 2 : side + 1; }
  static int previous(int side) { return side % 3 == 0 ? side + 2 : side - 1; }
  int from(int side) const { return sides_[at(side)].from; }
  int to(int side) const { return from(next(side)); }
  int twin(int side) const { return sides_[at(side)].twin; }  // -1 at the outermost triangle
  int run(int side) const { return sides_[at(side)].run; }    // -1 if none
  bool fixed(int side) const { return sides_[at(side)].fixed; }
  int first_around(int point) const { return leaving_[at(point)]; }
  /// The side that leaves the same point next in clockwise order.
  int next_clockwise(int side) const { return next(twin(side)); }

  /// The side from one point to another, -1 if they do not share an edge.
  int side_between(int a, int b) const;

  /// Whether a point is in the box.
  bool holds(const Eigen::Vector2d& p) const;

  /// The face that holds a point, found without crossing an edge that stays, or -1.
  int face_of(const Eigen::Vector2d& p, int start) const;

  /// The faces whose circumcircle holds a point of face `start`, connected without crossing an edge that stays.
  std::vector<int> cavity(const Eigen::Vector2d& p, int start) const;

  /// Moves a point if the faces round it keep their sense, and says so. `restore` must follow, once for any number of
  /// moves.
  bool move(int point, const Eigen::Vector2d& p);
  void restore();

 private:
  struct Place {
    std::int64_t x;
    std::int64_t y;
    bool operator==(const Place& other) const = default;
  };
  struct Side {
    int from;
    int twin = -1;
    int run = -1;
    bool fixed = false;
  };

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static std::int64_t turn(const Place& a, const Place& b, const Place& c);
  Place place_of(const Eigen::Vector2d& p) const;
  const Place& place(int point) const { return points_[at(point)]; }
  std::int64_t turn(int a, int b, int c) const { return turn(place(a), place(b), place(c)); }
  bool in_circle(int face, const Place& p) const;
  int holder(const Place& p, int face) const;
  int insert_in_face(const Place& p, int face);
  int insert_on_side(const Place& p, int side);
  void join(int side, const Side& old, int old_side);
  void pair(int side, int other);
  void flip(int side);
  bool can_flip(int side) const;
  void legalize(std::vector<int>& sides);
  int first_crossed(int a, int b) const;
  void clear_way(int a, int b);

  Eigen::Vector2d lower_;
  double scale_;
  std::vector<Place> points_;
  std::vector<Side> sides_;
  std::vector<int> leaving_;  // one side that leaves each point
  int last_ = 0;              // face of the last insertion
};

}  // namespace touchfield
