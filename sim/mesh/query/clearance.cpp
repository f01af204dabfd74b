#include "sim/mesh/query/clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/Eigenvalues>

#include "sim/core/require.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/self_intersections.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// A mesh and boxes round its faces, a little larger than they are: distances between boxes are lower bounds, and faces
/// that cut have boxes that meet.
struct BoxedSkin {
  explicit BoxedSkin(const TriangleMesh& skin) : mesh(skin), tree(boxes_round_faces(skin, kTouch)) {}

  const TriangleMesh& mesh;
  BoxTree tree;
};

/// Goes through the pairs of nodes of two trees, near ones first, for the nearest faces or the first that cut.
class NearestFaces {
 public:
  NearestFaces(const BoxedSkin& first, const BoxedSkin& second)
      : first_(first),
        second_(second),
        best_{Meeting::kApart, 0, Vector3::Zero(), Vector3::Zero(), -1, -1},
        least_(std::numeric_limits<double>::infinity()) {
    visit(0, 0);
  }

  Clearance found() const { return best_; }

 private:
  /// Pairs that meet are looked at even if some are known to touch: they may cut.
  bool can_matter(double squared) const { return best_.meeting != Meeting::kCut && (squared < least_ || squared == 0); }

  void visit(std::size_t m, std::size_t n) {
    const BoxTree::Node& one = first_.tree.nodes()[m];
    const BoxTree::Node& other = second_.tree.nodes()[n];
    if (!one.has_children() && !other.has_children()) {
      compare(one, other);
      return;
    }
    // The larger of the two is taken apart.
    const bool split_one = one.has_children() && (!other.has_children() || one.box.diagonal().squaredNorm() >=
                                                                               other.box.diagonal().squaredNorm());
    std::pair<std::size_t, std::size_t> near = split_one ? std::pair{m + 1, n} : std::pair{m, n + 1};
    std::pair<std::size_t, std::size_t> far =
        split_one ? std::pair{one.second_child, n} : std::pair{m, other.second_child};
    double to_near = squared_between(near);
    double to_far = squared_between(far);
    if (to_far < to_near) {
      std::swap(near, far);
      std::swap(to_near, to_far);
    }
    if (can_matter(to_near)) {
      visit(near.first, near.second);
    }
    if (can_matter(to_far)) {
      visit(far.first, far.second);
    }
  }

  double squared_between(const std::pair<std::size_t, std::size_t>& pair) const {
    return first_.tree.nodes()[pair.first].box.squaredExteriorDistance(second_.tree.nodes()[pair.second].box);
  }

  void compare(const BoxTree::Node& one, const BoxTree::Node& other) {
    for (std::size_t i = one.first; i < one.first + one.count; ++i) {
      for (std::size_t j = other.first; j < other.first + other.count; ++j) {
        const double squared = first_.tree.box(i).squaredExteriorDistance(second_.tree.box(j));
        if (can_matter(squared)) {
          compare_faces(first_.tree.number(i), second_.tree.number(j), squared == 0);
        }
      }
    }
  }

  void compare_faces(Index f, Index g, bool boxes_meet) {
    const Corners face = corners(first_.mesh, f);
    const Corners other = corners(second_.mesh, g);
    const PointPair nearest = nearest_points(face, other);
    const bool cut = boxes_meet && cut_each_other(face, other);
    if (cut || nearest.squared < least_) {
      least_ = nearest.squared;
      best_ = {cut ? Meeting::kCut : Meeting::kApart, cut ? 0.0 : std::sqrt(least_), nearest.on_a, nearest.on_b, f, g};
    }
  }

  const BoxedSkin& first_;
  const BoxedSkin& second_;
  Clearance best_;
  double least_;  // squared distance [m2]
};

/// Whether a face of a skin that does not cut the body's lies inside it. A face whose centroid touches the body's skin
/// does not tell.
bool lies_inside(const TriangleMesh& skin, const TriangleMesh& body, const FaceTree& tree) {
  const Box reach(body.vertices().rowwise().minCoeff().eval(), body.vertices().rowwise().maxCoeff().eval());
  const double touch = kTouch * reach.diagonal().norm();
  bool inside = false;
#pragma omp parallel for schedule(dynamic, 256) reduction(|| : inside) if (skin.face_count() > 2048)
  for (Index f = 0; f < skin.face_count(); ++f) {
    const Vector3 x = skin.centroids().col(f);
    inside = inside || (reach.contains(x) && tree.nearest(x, touch).face < 0 && tree.winding_number(x) > 0.5);
  }
  return inside;
}

std::map<int, Points> sorted_by(const Eigen::VectorXi& numbers, const Points& points) {
  std::map<int, std::vector<Index>> members;
  for (Index i = 0; i < points.cols(); ++i) {
    members[numbers(i)].push_back(i);
  }
  std::map<int, Points> sorted;
  for (const auto& [number, indices] : members) {
    sorted[number] = points(Eigen::all, indices);
  }
  return sorted;
}

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

Clearance least_clearance(const TriangleMesh& first, const TriangleMesh& second) {
  Clearance result = NearestFaces(BoxedSkin(first), BoxedSkin(second)).found();
  if (result.meeting == Meeting::kCut) {
    return result;
  }
  if (lies_inside(first, second, FaceTree(second))) {
    result.meeting = Meeting::kFirstInside;
    result.distance = 0;
  } else if (lies_inside(second, first, FaceTree(first))) {
    result.meeting = Meeting::kSecondInside;
    result.distance = 0;
  }
  return result;
}

std::vector<PointClearance> point_clearances(const TriangleMesh& body, const Points& points) {
  const FaceTree tree(body);
  std::vector<PointClearance> result(static_cast<std::size_t>(points.cols()));
#pragma omp parallel for schedule(dynamic, 64) if (points.cols() > 512)
  for (Index i = 0; i < points.cols(); ++i) {
    const Vector3 x = points.col(i);
    const SkinPoint skin = tree.nearest(x);
    result[static_cast<std::size_t>(i)] = {skin.distance, tree.winding_number(x) > 0.5, skin.face};
  }
  return result;
}

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

std::optional<PlateCollision> plate_collision(const TriangleMesh& body, const Points& positions,
                                              const Eigen::VectorXi& plates, double clearance) {
  constexpr double kFlat = 1e-3;  // [m], more than the heights of soldered transducers scatter
  require(plates.size() == positions.cols(), "plates: {} numbers for {} positions", plates.size(), positions.cols());
  require(clearance >= 0, "plates: clearance = {} m must be >= 0", clearance);
  const BoxedSkin skin(body);
  const FaceTree tree(body);
  std::optional<PlateCollision> nearest;
  for (const auto& [number, points] : sorted_by(plates, positions)) {
    const std::optional<TriangleMesh> plate = flat_hull(points, kFlat);
    if (!plate) {
      continue;
    }
    Clearance found = NearestFaces(skin, BoxedSkin(*plate)).found();
    const bool meets = found.meeting == Meeting::kCut || lies_inside(*plate, body, tree);
    const double distance = meets ? 0.0 : found.distance;
    if ((meets || distance < clearance) && (!nearest || distance < nearest->distance)) {
      nearest = PlateCollision{number, distance, found.on_second, found.first_face};
    }
  }
  return nearest;
}

}  // namespace touchfield
