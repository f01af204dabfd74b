#include "sim/mesh/query/face_tree.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/mesh/face_shape.h"

namespace touchfield {

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

FaceTree::FaceTree(const TriangleMesh& mesh)
    : tree_(boxes_round_faces(mesh, 0.0)), touch_(1e-4 * std::sqrt(mesh.areas().maxCoeff())) {
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
  SkinPoint best{-1, Vector3::Zero(), std::numeric_limits<double>::infinity()};
  double least = within * within;
  tree_.approach(x, least, [&](std::size_t place) {
    const Leaf& leaf = leaves_[place];
    if (!allowed(leaf)) {
      return;
    }
    const Vector3 at = nearest_on_triangle(leaf.a, leaf.b, leaf.c, x);
    if (const double squared = (at - x).squaredNorm(); squared < least) {
      least = squared;
      best = {leaf.face, at, 0};
    }
  });
  if (best.face >= 0) {
    best.distance = std::sqrt(least);
  }
  return best;
}

SkinPoint FaceTree::nearest(const Vector3& x, double within) const {
  return search(x, within, [](const Leaf&) { return true; });
}

SkinPoint FaceTree::touched(const Vector3& x) const { return nearest(x, touch_); }

SkinPoint FaceTree::nearest_facing(const Vector3& x, const Vector3& direction, double least_cosine) const {
  return search(x, std::numeric_limits<double>::infinity(),
                [&](const Leaf& leaf) { return leaf.normal.dot(direction) >= least_cosine; });
}

void FaceTree::centroids_within(const Vector3& x, double radius, std::vector<Eigen::Index>& found) const {
  found.clear();
  tree_.walk([&](std::size_t n) { return tree_.squared_distance(n, x) <= radius * radius; },
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
