#include "sim/mesh/query/flat_hull.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include <Eigen/Eigenvalues>

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// Twice the area of the triangle i, j, k, positive if it turns left.
double turn(const Eigen::Matrix2Xd& points, Index i, Index j, Index k) {
  const Eigen::Vector2d u = points.col(j) - points.col(i);
  const Eigen::Vector2d v = points.col(k) - points.col(j);
  return u.x() * v.y() - u.y() * v.x();
}

/// The convex hull, counter-clockwise, with all that rounding leaves on its sides.
///
/// source   Andrew, Another efficient algorithm for convex hulls in two dimensions, Inf. Proc. Lett. 9 (1979) 216
std::vector<Index> convex_hull(const Eigen::Matrix2Xd& points) {
  std::vector<Index> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index i, Index j) {
    return points(0, i) < points(0, j) || (points(0, i) == points(0, j) && points(1, i) < points(1, j));
  });
  std::vector<Index> hull;
  const auto add_side = [&](auto begin, auto end) {
    const std::size_t start = hull.size();
    for (auto i = begin; i != end; ++i) {
      while (hull.size() >= start + 2 && turn(points, hull[hull.size() - 2], hull.back(), *i) <= 0) {
        hull.pop_back();
      }
      hull.push_back(*i);
    }
    hull.pop_back();  // it starts the other side
  };
  add_side(order.begin(), order.end());
  add_side(order.rbegin(), order.rend());
  return hull;
}

/// A hull without the corners that stand out by less than a share of its size.
std::vector<Index> without_straight_corners(const Eigen::Matrix2Xd& points, const std::vector<Index>& hull) {
  constexpr double kStraight = 1e-9;
  const double least = kStraight * (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).squaredNorm();
  std::vector<Index> corners;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Index before = corners.empty() ? hull.back() : corners.back();
    const Index after = i + 1 < hull.size() ? hull[i + 1] : (corners.empty() ? hull : corners).front();
    if (turn(points, before, hull[i], after) > least) {
      corners.push_back(hull[i]);
    }
  }
  return corners;
}

}  // namespace

std::optional<TriangleMesh> flat_hull(const Points& points, double flat) {
  constexpr double kThin = 1e-3;
  if (points.cols() < 3) {
    return std::nullopt;
  }
  const Vector3 middle = points.rowwise().mean();
  const Points from_middle = points.colwise() - middle;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(from_middle * from_middle.transpose());
  const Eigen::Matrix3d axes = spread.eigenvectors();  // across the plane, along its width, along its length
  const Points turned = axes.transpose() * from_middle;
  const Vector3 size = turned.rowwise().maxCoeff() - turned.rowwise().minCoeff();
  if (turned.row(0).cwiseAbs().maxCoeff() > flat || size(1) <= kThin * size(2)) {
    return std::nullopt;
  }
  const Eigen::Matrix2Xd flattened = turned.bottomRows<2>();
  const std::vector<Index> corners = without_straight_corners(flattened, convex_hull(flattened));
  if (corners.size() < 3) {
    return std::nullopt;
  }
  Points vertices = Points(turned(Eigen::all, corners));
  vertices.row(0).setZero();
  vertices = (axes * vertices).colwise() + middle;
  Triangles triangles(3, static_cast<Index>(corners.size()) - 2);
  for (int f = 0; f < triangles.cols(); ++f) {
    triangles.col(f) << 0, f + 1, f + 2;
  }
  return TriangleMesh(vertices, triangles);
}

}  // namespace touchfield
