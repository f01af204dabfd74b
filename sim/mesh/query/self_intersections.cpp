#include "sim/mesh/query/self_intersections.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/mesh/query/face_tree.h"

namespace touchfield {

namespace {

Vector3 edge(const Corners& triangle, int c) { return triangle.col((c + 1) % 3) - triangle.col(c); }

/// Whether an axis shows that two triangles do not overlap by more than `touch`. An axis along which neither is wider
/// than that and which does not part them shows nothing: it is the normal of their common plane.
bool parts(const Vector3& axis, const Corners& a, const Corners& b, double touch) {
  const Eigen::RowVector3d along_a = axis.transpose() * a;
  const Eigen::RowVector3d along_b = axis.transpose() * b;
  const double least_a = along_a.minCoeff();
  const double most_a = along_a.maxCoeff();
  const double least_b = along_b.minCoeff();
  const double most_b = along_b.maxCoeff();
  const double limit = touch * axis.norm();
  return std::min(most_a - least_b, most_b - least_a) <= limit &&
         std::max(most_a, most_b) - std::min(least_a, least_b) > limit;
}

/// The nearest points of the segments p + s u and q + t v, 0 <= s, t <= 1.
PointPair nearest_on_segments(const Vector3& p, const Vector3& u, const Vector3& q, const Vector3& v) {
  const Vector3 from_q = p - q;
  const double uu = u.squaredNorm();
  const double vv = v.squaredNorm();
  const double uv = u.dot(v);
  const double u_from_q = u.dot(from_q);
  const double v_from_q = v.dot(from_q);
  // Where the lines are nearest; of parallel lines any place is. Then the nearest t, and s again where t is clamped.
  const double determinant = uu * vv - uv * uv;
  double s = determinant > 0 ? std::clamp((uv * v_from_q - vv * u_from_q) / determinant, 0.0, 1.0) : 0.0;
  double t = (uv * s + v_from_q) / vv;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((uv * t - u_from_q) / uu, 0.0, 1.0);
  }
  const Vector3 on_a = p + s * u;
  const Vector3 on_b = q + t * v;
  return {on_a, on_b, (on_a - on_b).squaredNorm()};
}

/// Coordinates along u and v of the foot of x in the plane u, v.
struct Foot {
  double s;
  double t;

  bool in_triangle() const { return s >= 0 && t >= 0 && s + t <= 1; }
};

/// A face in the form that its edges leave to be tested: its plane.
struct Plate {
  explicit Plate(const Corners& triangle)
      : corner(triangle.col(0)), u(edge(triangle, 0)), v(-edge(triangle, 2)), normal(u.cross(v)) {}

  Foot foot(const Vector3& x) const {
    const Vector3 from = x - corner;
    const double squared = normal.squaredNorm();
    return {from.cross(v).dot(normal) / squared, u.cross(from).dot(normal) / squared};
  }

  double height(const Vector3& x) const { return (x - corner).dot(normal); }  // over the normal's length

  Vector3 point(const Foot& foot) const { return corner + foot.s * u + foot.t * v; }

  Vector3 corner;
  Vector3 u;
  Vector3 v;
  Vector3 normal;
};

/// Makes `best` nearer by the corners of a triangle over a plate, and the edges of the triangle through it; swapped
/// tells that the triangle is b.
void consider(const Corners& triangle, const Plate& plate, bool swapped, PointPair& best) {
  const auto keep_nearer = [&](const Vector3& x, const Vector3& on_plate) {
    const double squared = (x - on_plate).squaredNorm();
    if (squared < best.squared) {
      best = swapped ? PointPair{on_plate, x, squared} : PointPair{x, on_plate, squared};
    }
  };
  for (int c = 0; c < 3; ++c) {
    const Vector3 x = triangle.col(c);
    if (const Foot foot = plate.foot(x); foot.in_triangle()) {
      keep_nearer(x, plate.point(foot));
    }
    const double start = plate.height(x);
    const double end = plate.height(triangle.col((c + 1) % 3));
    if ((start < 0 && end > 0) || (start > 0 && end < 0)) {
      const Vector3 through = x + start / (start - end) * edge(triangle, c);
      if (const Foot foot = plate.foot(through); foot.in_triangle()) {
        keep_nearer(through, plate.point(foot));
      }
    }
  }
}

using Index = Eigen::Index;
using Pairs = std::vector<std::pair<Index, Index>>;

/// The pairs of a face f of `one` and a face g >= first(f) of `other` that cut each other, in order. Goes through `one`
/// in blocks, each twice as long as the last, and ends with the block that makes them enough: what is found does not
/// depend on the threads.
template <class First>
Pairs cutting_pairs(const TriangleMesh& one, const std::vector<Box>& boxes, const TriangleMesh& other,
                    const BoxTree& tree, const First& first, std::size_t most) {
  Pairs pairs;
  std::vector<std::vector<Index>> cutting;
  Index length = 2048;
  for (Index begin = 0; begin < one.face_count() && pairs.size() < most; begin += length, length *= 2) {
    const Index end = std::min(one.face_count(), begin + length);
    cutting.assign(static_cast<std::size_t>(end - begin), {});
#pragma omp parallel for schedule(dynamic, 64) if (end - begin > 1024)
    for (Index f = begin; f < end; ++f) {
      const Corners face = corners(one, f);
      std::vector<Index>& found = cutting[static_cast<std::size_t>(f - begin)];
      tree.for_each_meeting(boxes[static_cast<std::size_t>(f)], [&](Index g) {
        if (g >= first(f) && found.size() < most && cut_each_other(face, corners(other, g))) {
          found.push_back(g);
        }
      });
      std::sort(found.begin(), found.end());
    }
    for (Index f = begin; f < end; ++f) {
      for (const Index g : cutting[static_cast<std::size_t>(f - begin)]) {
        pairs.emplace_back(f, g);
      }
    }
  }
  pairs.resize(std::min(pairs.size(), most));
  return pairs;
}

}  // namespace

double longest_edge(const Corners& triangle) {
  return std::sqrt(
      std::max({edge(triangle, 0).squaredNorm(), edge(triangle, 1).squaredNorm(), edge(triangle, 2).squaredNorm()}));
}

bool cut_each_other(const Corners& a, const Corners& b) {
  // From a common near origin, so that far from the scene's origin nothing is lost in the products.
  const Vector3 origin = a.col(0);
  const Corners s = a.colwise() - origin;
  const Corners t = b.colwise() - origin;
  const double touch = kTouch * std::max(longest_edge(s), longest_edge(t));
  const Vector3 normal_s = edge(s, 0).cross(edge(s, 1)).normalized();
  const Vector3 normal_t = edge(t, 0).cross(edge(t, 1)).normalized();
  if (parts(normal_s, s, t, touch) || parts(normal_t, s, t, touch)) {
    return false;
  }
  for (int c = 0; c < 3; ++c) {
    if (parts(normal_s.cross(edge(s, c)), s, t, touch) || parts(normal_t.cross(edge(t, c)), s, t, touch)) {
      return false;
    }
  }
  for (int c = 0; c < 3; ++c) {
    for (int d = 0; d < 3; ++d) {
      // Parallel edges have no product; what rounding leaves of it is an axis like any other.
      if (parts(edge(s, c).cross(edge(t, d)), s, t, touch)) {
        return false;
      }
    }
  }
  return true;
}

PointPair nearest_points(const Corners& a, const Corners& b) {
  PointPair best{Vector3::Zero(), Vector3::Zero(), std::numeric_limits<double>::infinity()};
  for (int c = 0; c < 3; ++c) {
    for (int d = 0; d < 3; ++d) {
      const PointPair found = nearest_on_segments(a.col(c), edge(a, c), b.col(d), edge(b, d));
      if (found.squared < best.squared) {
        best = found;
      }
    }
  }
  consider(a, Plate(b), false, best);
  consider(b, Plate(a), true, best);
  return best;
}

Pairs self_intersections(const TriangleMesh& mesh, std::size_t most) {
  const std::vector<Box> boxes = boxes_round_faces(mesh, kTouch);
  return cutting_pairs(
      mesh, boxes, mesh, BoxTree(boxes), [](Index f) { return f + 1; }, most);
}

std::string self_intersections_text(const TriangleMesh& mesh, const Pairs& pairs, std::size_t most) {
  if (pairs.empty()) {
    return {};
  }
  const auto [one, other] = pairs.front();
  return fmt::format("{} of faces intersect, the first near {}",
                     counted(static_cast<Index>(pairs.size()), "pair", pairs.size() < most ? "pairs" : "pairs or more"),
                     place_text(0.5 * (mesh.centroids().col(one) + mesh.centroids().col(other)), 2));
}

Pairs intersections(const TriangleMesh& one, const TriangleMesh& other, std::size_t most) {
  return cutting_pairs(
      one, boxes_round_faces(one, kTouch), other, BoxTree(boxes_round_faces(other, kTouch)), [](Index) { return 0; },
      most);
}

}  // namespace touchfield
