#include "sim/mesh/query/box_tree.h"

#include <algorithm>
#include <numeric>

#include "sim/mesh/query/triangle_pair.h"

namespace touchfield {

std::vector<Box> boxes_round_faces(const TriangleMesh& mesh, double touch) {
  std::vector<Box> boxes;
  boxes.reserve(static_cast<std::size_t>(mesh.face_count()));
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Corners face = corners(mesh, f);
    const double margin = touch * longest_edge(face);
    boxes.emplace_back((face.rowwise().minCoeff().array() - margin).matrix(),
                       (face.rowwise().maxCoeff().array() + margin).matrix());
  }
  return boxes;
}

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

}  // namespace touchfield
