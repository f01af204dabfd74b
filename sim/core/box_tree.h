#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "sim/core/types.h"

namespace touchfield {

using Box = Eigen::AlignedBox3d;

/// Boxes along the axes, or points, in a tree of boxes round groups of them, to find those that meet or are near
/// something. Any number of threads may ask at once.
class BoxTree {
 public:
  struct Node {  // holds places first .. first + count - 1; its first child is the next node
    Box box;
    std::size_t first;
    std::size_t count;
    std::size_t second_child;  // 0 if it has no children

    bool has_children() const { return second_child != 0; }
  };

  /// boxes   one or more, numbered from 0
  explicit BoxTree(const std::vector<Box>& boxes);

  /// The nodes, the root first.
  const std::vector<Node>& nodes() const { return nodes_; }

  /// What number the box at a place has, and the box.
  Eigen::Index number(std::size_t place) const { return numbers_[place]; }
  const Box& box(std::size_t place) const { return boxes_[place]; }

  /// Goes down from the root: opens the nodes n of which enter(n) holds, and calls visit(place) for the places of those
  /// without children. In no order.
  template <class Enter, class Visit>
  void walk(const Enter& enter, const Visit& visit) const {
    std::array<std::size_t, kStack> stack;
    std::size_t waiting = 0;
    stack[waiting++] = 0;
    while (waiting > 0) {
      const std::size_t n = stack[--waiting];
      if (!enter(n)) {
        continue;
      }
      if (const Node& node = nodes_[n]; node.has_children()) {
        stack[waiting++] = node.second_child;
        stack[waiting++] = n + 1;
      } else {
        for (std::size_t i = node.first; i < node.first + node.count; ++i) {
          visit(i);
        }
      }
    }
  }

  /// Calls visit(number) for each box that meets the given one, in no order.
  template <class Visit>
  void for_each_meeting(const Box& box, const Visit& visit) const {
    walk([&](std::size_t n) { return nodes_[n].box.intersects(box); },
         [&](std::size_t place) {
           if (boxes_[place].intersects(box)) {
             visit(numbers_[place]);
           }
         });
  }

  double squared_distance(std::size_t node, const Vector3& x) const {
    const Box& box = nodes_[node].box;
    return (box.min() - x).cwiseMax(x - box.max()).cwiseMax(0.0).squaredNorm();
  }

  /// Goes to what is near x, near nodes first: calls visit(place) for the places of nodes nearer than sqrt(least).
  /// visit lowers `least` to the squared distance of what it finds.
  template <class Visit>
  void approach(const Vector3& x, const double& least, const Visit& visit) const {
    using Waiting = std::pair<std::size_t, double>;  // a node and its squared distance
    std::array<Waiting, kStack> stack;
    std::size_t waiting = 0;
    stack[waiting++] = {0, squared_distance(0, x)};
    while (waiting > 0) {
      const auto [n, squared] = stack[--waiting];
      if (squared >= least) {
        continue;
      }
      const Node& node = nodes_[n];
      if (!node.has_children()) {
        for (std::size_t i = node.first; i < node.first + node.count; ++i) {
          visit(i);
        }
        continue;
      }
      Waiting near{n + 1, squared_distance(n + 1, x)};
      Waiting far{node.second_child, squared_distance(node.second_child, x)};
      if (far.second < near.second) {
        std::swap(near, far);
      }
      stack[waiting++] = far;
      stack[waiting++] = near;
    }
  }

 private:
  /// The halving of 2^31 boxes ends after 31 levels, and each level leaves one node waiting.
  static constexpr std::size_t kStack = 64;

  std::size_t build(const std::vector<Box>& boxes, std::size_t first, std::size_t count);

  std::vector<Node> nodes_;
  std::vector<Box> boxes_;  // by place
  std::vector<Eigen::Index> numbers_;
};

/// The nearest other point of each point. Of equally near ones it is that of the lowest number.
struct Neighbours {
  std::vector<Eigen::Index> number;  // -1 of a point that is alone
  Eigen::VectorXd squared;           // distance [m2]; infinite of a point that is alone
};

/// points   3 x n [m]; takes n log n steps
Neighbours nearest_neighbours(const Points& points);

}  // namespace touchfield
