#include "sim/mesh/query/face_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

namespace touchfield {

namespace {

constexpr std::size_t kLeavesPerNode = 4;
// The halving of 2^31 faces ends after 31 levels, and each level leaves one node waiting.
constexpr std::size_t kStack = 64;

/// The point of triangle a, b, c that is nearest to x.
///
/// source   Ericson, Real-Time Collision Detection, 5.1.5
Vector3 nearest_on_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& x) {
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const double a1 = ab.dot(x - a);
  const double a2 = ac.dot(x - a);
  if (a1 <= 0 && a2 <= 0) {
    return a;
  }
  const double b1 = ab.dot(x - b);
  const double b2 = ac.dot(x - b);
  if (b1 >= 0 && b2 <= b1) {
    return b;
  }
  const double c1 = ab.dot(x - c);
  const double c2 = ac.dot(x - c);
  if (c2 >= 0 && c1 <= c2) {
    return c;
  }
  const double at_c = a1 * b2 - b1 * a2;
  if (at_c <= 0 && a1 >= 0 && b1 <= 0) {
    return a + a1 / (a1 - b1) * ab;
  }
  const double at_b = c1 * a2 - a1 * c2;
  if (at_b <= 0 && a2 >= 0 && c2 <= 0) {
    return a + a2 / (a2 - c2) * ac;
  }
  const double at_a = b1 * c2 - c1 * b2;
  if (at_a <= 0 && b2 >= b1 && c1 >= c2) {
    return b + (b2 - b1) / ((b2 - b1) + (c1 - c2)) * (c - b);
  }
  return a + (at_b * ab + at_c * ac) / (at_a + at_b + at_c);
}

/// Solid angle of a triangle seen from its origin side [sr]; a, b, c relative to the eye. Positive if it turns its
/// back.
double solid_angle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const double la = a.norm();
  const double lb = b.norm();
  const double lc = c.norm();
  return 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

double squared_distance(const Vector3& lower, const Vector3& upper, const Vector3& x) {
  return (lower - x).cwiseMax(x - upper).cwiseMax(0.0).squaredNorm();
}

}  // namespace

FaceTree::FaceTree(const TriangleMesh& mesh) {
  const auto count = static_cast<std::size_t>(mesh.face_count());
  std::vector<Eigen::Index> faces(count);
  std::iota(faces.begin(), faces.end(), 0);
  build(mesh, faces, 0, count);
  leaves_.reserve(count);
  for (const Eigen::Index f : faces) {
    leaves_.push_back({mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2), mesh.normals().col(f), f});
  }
}

std::size_t FaceTree::build(const TriangleMesh& mesh, std::vector<Eigen::Index>& faces, std::size_t first,
                            std::size_t count) {
  const auto begin = faces.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  Node node{Vector3::Constant(std::numeric_limits<double>::infinity()),
            Vector3::Constant(-std::numeric_limits<double>::infinity()), first, count, 0};
  Moments moments{Vector3::Zero(), Vector3::Zero(), Eigen::Matrix3d::Zero(), 0};
  double area = 0;
  for (auto f = begin; f != end; ++f) {
    for (int c = 0; c < 3; ++c) {
      node.lower = node.lower.cwiseMin(mesh.corner(*f, c));
      node.upper = node.upper.cwiseMax(mesh.corner(*f, c));
    }
    area += mesh.areas()(*f);
    moments.at += mesh.areas()(*f) * mesh.centroids().col(*f);
    moments.area += mesh.areas()(*f) * mesh.normals().col(*f);
  }
  moments.at /= area;
  for (auto f = begin; f != end; ++f) {
    moments.spread += mesh.areas()(*f) * (mesh.centroids().col(*f) - moments.at) * mesh.normals().col(*f).transpose();
    for (int c = 0; c < 3; ++c) {
      moments.radius = std::max(moments.radius, (mesh.corner(*f, c) - moments.at).norm());
    }
  }

  const std::size_t number = nodes_.size();
  nodes_.push_back(node);
  moments_.push_back(moments);
  if (count > kLeavesPerNode) {
    Eigen::Index axis = 0;
    (node.upper - node.lower).maxCoeff(&axis);
    const std::size_t half = count / 2;
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(half), end, [&](Eigen::Index f, Eigen::Index g) {
      return mesh.centroids()(axis, f) < mesh.centroids()(axis, g);
    });
    build(mesh, faces, first, half);
    nodes_[number].second_child = build(mesh, faces, first + half, count - half);
  }
  return number;
}

template <class Allowed>
SkinPoint FaceTree::search(const Vector3& x, double within, const Allowed& allowed) const {
  struct Waiting {
    std::size_t node;
    double squared;
  };
  std::array<Waiting, kStack> stack;
  std::size_t waiting = 0;
  const auto squared_to = [&](std::size_t n) { return squared_distance(nodes_[n].lower, nodes_[n].upper, x); };
  SkinPoint best{-1, Vector3::Zero(), std::numeric_limits<double>::infinity()};
  double least = within * within;
  stack[waiting++] = {0, squared_to(0)};
  while (waiting > 0) {
    const auto [n, squared] = stack[--waiting];
    if (squared >= least) {
      continue;
    }
    const Node& node = nodes_[n];
    if (node.second_child == 0) {
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
  std::array<std::size_t, kStack> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  while (waiting > 0) {
    const std::size_t n = stack[--waiting];
    const Node& node = nodes_[n];
    if (squared_distance(node.lower, node.upper, x) > radius * radius) {
      continue;
    }
    if (node.second_child != 0) {
      stack[waiting++] = node.second_child;
      stack[waiting++] = n + 1;
      continue;
    }
    for (std::size_t i = node.first; i < node.first + node.count; ++i) {
      const Leaf& leaf = leaves_[i];
      if (((leaf.a + leaf.b + leaf.c) / 3.0 - x).squaredNorm() <= radius * radius) {
        found.push_back(leaf.face);
      }
    }
  }
}

double FaceTree::winding_number(const Vector3& x) const {
  constexpr double kFar = 2.5;  // radii of a group, beyond which its higher moments fall off fast
  std::array<std::size_t, kStack> stack;
  std::size_t waiting = 0;
  stack[waiting++] = 0;
  double angle = 0;
  while (waiting > 0) {
    const std::size_t n = stack[--waiting];
    const Moments& group = moments_[n];
    const Vector3 to = group.at - x;
    const double squared = to.squaredNorm();
    if (squared > kFar * kFar * group.radius * group.radius) {
      // The kernel to / |to|^3 and its gradient, against area and spread.
      angle += (group.area.dot(to) + group.spread.trace() - 3.0 * to.dot(group.spread * to) / squared) /
               (squared * std::sqrt(squared));
    } else if (const Node& node = nodes_[n]; node.second_child != 0) {
      stack[waiting++] = node.second_child;
      stack[waiting++] = n + 1;
    } else {
      for (std::size_t i = node.first; i < node.first + node.count; ++i) {
        angle += solid_angle(leaves_[i].a - x, leaves_[i].b - x, leaves_[i].c - x);
      }
    }
  }
  return angle / (4.0 * std::numbers::pi);
}

}  // namespace touchfield
