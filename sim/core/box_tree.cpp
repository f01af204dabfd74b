#include "sim/core/box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace touchfield {

BoxTree::BoxTree(const std::vector<Box>& boxes) : numbers_(boxes.size()) {
  std::iota(numbers_.begin(), numbers_.end(), 0);
  build(boxes, 0, boxes.size());
  boxes_.reserve(boxes.size());
  for (const Eigen::Index i : numbers_) {
    boxes_.push_back(boxes[static_cast<std::size_t>(i)]);
  }
}

std::size_t BoxTree::build(const std::vector<Box>& boxes, std::size_t first, std::size_t count) {
  constexpr std::size_t kBoxesPerNode = 4;
  const auto box = [&](Eigen::Index i) -> const Box& { return boxes[static_cast<std::size_t>(i)]; };
  const auto begin = numbers_.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  Node node{Box(), first, count, 0};
  std::for_each(begin, end, [&](Eigen::Index i) { node.box.extend(box(i)); });
  const std::size_t number = nodes_.size();
  nodes_.push_back(node);
  if (count > kBoxesPerNode) {
    Eigen::Index axis = 0;
    node.box.sizes().maxCoeff(&axis);
    const std::size_t half = count / 2;
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(half), end, [&](Eigen::Index i, Eigen::Index j) {
      return box(i).min()(axis) + box(i).max()(axis) < box(j).min()(axis) + box(j).max()(axis);
    });
    build(boxes, first, half);
    nodes_[number].second_child = build(boxes, first + half, count - half);
  }
  return number;
}

Neighbours nearest_neighbours(const Points& points) {
  Neighbours found{std::vector<Eigen::Index>(static_cast<std::size_t>(points.cols()), -1),
                   Eigen::VectorXd::Constant(points.cols(), std::numeric_limits<double>::infinity())};
  if (points.cols() < 2) {
    return found;
  }
  std::vector<Box> boxes;
  for (const Vector3 x : points.colwise()) {
    boxes.emplace_back(x, x);
  }
  const BoxTree tree(boxes);
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    Eigen::Index& nearest = found.number[static_cast<std::size_t>(n)];
    double& least = found.squared(n);
    double open = least;  // so that boxes at the very distance are opened too
    tree.approach(points.col(n), open, [&](std::size_t place) {
      const Eigen::Index m = tree.number(place);
      const double squared = (points.col(m) - points.col(n)).squaredNorm();
      if (m != n && (squared < least || (squared == least && m < nearest))) {
        least = squared;
        open = std::nextafter(squared, std::numeric_limits<double>::infinity());
        nearest = m;
      }
    });
  }
  return found;
}

}  // namespace touchfield
