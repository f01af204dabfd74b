#include "sim/mesh/query/face_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "sim/mesh/face_shape.h"

namespace touchfield {

namespace {

double squared_distance(const Box& box, const Vector3& x) {
  return (box.min() - x).cwiseMax(x - box.max()).cwiseMax(0.0).squaredNorm();
}

}  // namespace

std::vector<Box> boxes_round_faces(const TriangleMesh& mesh, double touch) {
  std::vector<Box> boxes;
  boxes.reserve(static_cast<std::size_t>(mesh.face_count()));
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Corners face = corners(mesh, f);
    const double margin = touch * longest_edge(mesh, f);
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

FaceTree::FaceTree(const TriangleMesh& mesh) : tree_(boxes_round_faces(mesh, 0.0)) {
  const Eigen::Index count = mesh.face_count();
  leaves_.reserve(static_cast<std::size_t>(count));
  for (Eigen::Index place = 0; place < count; ++place) {
    const Eigen::Index f = tree_.number(static_cast<std::size_t>(place));
    leaves_.push_back({mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2), mesh.normals().col(f), f});
  }
  moments_.reserve(tree_.nodes().size());
  for (const BoxTree::Node& node : tree_.nodes()) {
    moments_.push_back(moments_of(mesh, node));
  }
}

FaceTree::Moments FaceTree::moments_of(const TriangleMesh& mesh, const BoxTree::Node& node) const {
  Moments moments{Vector3::Zero(), Vector3::Zero(), Eigen::Matrix3d::Zero(), 0};
  double area = 0;
  for (std::size_t place = node.first; place < node.first + node.count; ++place) {
    const Eigen::Index f = tree_.number(place);
    area += mesh.areas()(f);
    moments.at += mesh.areas()(f) * mesh.centroids().col(f);
    moments.area += mesh.areas()(f) * mesh.normals().col(f);
  }
  moments.at /= area;
  for (std::size_t place = node.first; place < node.first + node.count; ++place) {
    const Eigen::Index f = tree_.number(place);
    moments.spread += mesh.areas()(f) * (mesh.centroids().col(f) - moments.at) * mesh.normals().col(f).transpose();
    for (int c = 0; c < 3; ++c) {
      moments.radius = std::max(moments.radius, (mesh.corner(f, c) - moments.at).norm());
    }
  }
  return moments;
}

template <class Allowed>
SkinPoint FaceTree::search(const Vector3& x, double within, const Allowed& allowed) const {
  struct Waiting {
    std::size_t node;
    double squared;
  };
  std::array<Waiting, BoxTree::kStack> stack;
  std::size_t waiting = 0;
  const auto squared_to = [&](std::size_t n) { return squared_distance(tree_.nodes()[n].box, x); };
  SkinPoint best{-1, Vector3::Zero(), std::numeric_limits<double>::infinity()};
  double least = within * within;
  stack[waiting++] = {0, squared_to(0)};
  while (waiting > 0) {
    const auto [n, squared] = stack[--waiting];
    if (squared >= least) {
      continue;
    }
    const BoxTree::Node& node = tree_.nodes()[n];
    if (!node.has_children()) {
      for (std::size_t i = node.first; i < node.first + node.count; ++i) {
        const Leaf& leaf = leaves_[i];
        if (!allowed(leaf)) {
          continue;
        }
        const Vector3 at = nearest_on_triangle(leaf.a, leaf.b, leaf.c, x);
        const double to_leaf = (at - x).squaredNorm();
        if (to_leaf < least) {
          least = to_leaf;
          best = {leaf.face, at, 0};
        }
      }
      continue;
    }
    Waiting near{n + 1, squared_to(n + 1)};
    Waiting far{node.second_child, squared_to(node.second_child)};
    if (far.squared < near.squared) {
      std::swap(near, far);
    }
    stack[waiting++] = far;
    stack[waiting++] = near;
  }
  if (best.face >= 0) {
    best.distance = std::sqrt(least);
  }
  return best;
}

SkinPoint FaceTree::nearest(const Vector3& x, double within) const {
  return search(x, within, [](const Leaf&) { return true; });
}

SkinPoint FaceTree::nearest_facing(const Vector3& x, const Vector3& direction, double least_cosine) const {
  return search(x, std::numeric_limits<double>::infinity(),
                [&](const Leaf& leaf) { return leaf.normal.dot(direction) >= least_cosine; });
}

void FaceTree::centroids_within(const Vector3& x, double radius, std::vector<Eigen::Index>& found) const {
  found.clear();
  tree_.walk([&](std::size_t n) { return squared_distance(tree_.nodes()[n].box, x) <= radius * radius; },
             [&](std::size_t place) {
               const Leaf& leaf = leaves_[place];
               if (((leaf.a + leaf.b + leaf.c) / 3.0 - x).squaredNorm() <= radius * radius) {
                 found.push_back(leaf.face);
               }
             });
}

double FaceTree::winding_number(const Vector3& x) const {
  constexpr double kFar = 2.5;  // radii of a group, beyond which its higher moments fall off fast
  double angle = 0;
  const auto is_near = [&](std::size_t n) {
    const Moments& group = moments_[n];
    const Vector3 to = group.at - x;
    const double squared = to.squaredNorm();
    if (squared <= kFar * kFar * group.radius * group.radius) {
      return true;
    }
    // The kernel to / |to|^3 and its gradient, against area and spread.
    angle += (group.area.dot(to) + group.spread.trace() - 3.0 * to.dot(group.spread * to) / squared) /
             (squared * std::sqrt(squared));
    return false;
  };
  tree_.walk(is_near, [&](std::size_t place) {
    angle += solid_angle(leaves_[place].a - x, leaves_[place].b - x, leaves_[place].c - x);
  });
  return angle / (4.0 * std::numbers::pi);
}

}  // namespace touchfield
