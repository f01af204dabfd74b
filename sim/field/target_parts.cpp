#include "sim/field/target_parts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

namespace touchfield {

namespace {

constexpr double kOnSide = 1e-9;  // [m]: what is nearer to a side lies on it

using Polygon = std::vector<Vector3>;

/// A half of space: the points x with normal^T x <= reach, in a box's own frame.
struct HalfSpace {
  Vector3 normal;
  double reach;

  double beyond(const Vector3& x) const { return normal.dot(x) - reach; }
};

/// What a box holds, as the half-spaces that have it in common.
class ConvexBox {
 public:
  explicit ConvexBox(const TargetBox& box) : box_(box) {
    const bool is_round = box.shape == TargetShape::kCylinder;
    for (int axis = is_round ? 2 : 0; axis < 3; ++axis) {
      sides_.push_back({Vector3::Unit(axis), 0.5 * box.size[axis]});
      sides_.push_back({-Vector3::Unit(axis), 0.5 * box.size[axis]});
    }
    if (is_round) {
      constexpr int kSides = 64;
      constexpr double kHalf = std::numbers::pi / kSides;
      // Apothem of the regular polygon whose area is that of the circle.
      const double reach = 0.5 * box.size.x() * std::sqrt(kHalf / std::tan(kHalf));
      for (int i = 0; i < kSides; ++i) {
        sides_.push_back({{std::cos(2 * i * kHalf), std::sin(2 * i * kHalf), 0.0}, reach});
      }
      radius_ = reach;
    }
  }

  const std::vector<HalfSpace>& sides() const { return sides_; }
  Vector3 own(const Vector3& x) const { return in_box_frame(box_, x); }
  Vector3 world(const Vector3& x) const { return box_.centre + box_.rotation * x; }

  /// How far a point of the own frame is outside, at least; negative inside, by the distance to the nearest side.
  double distance(const Vector3& x) const {
    const Vector3 from = x.cwiseAbs() - 0.5 * box_.size;
    return radius_ > 0 ? std::max(x.head<2>().norm() - radius_, from.z()) : from.maxCoeff();
  }

 private:
  const TargetBox& box_;
  std::vector<HalfSpace> sides_;
  double radius_ = 0.0;  // of a cylinder: of the circle in its section
};

/// What of a convex polygon is in a half-space, and what is not; empty if nothing is.
std::pair<Polygon, Polygon> split(const Polygon& polygon, const HalfSpace& side) {
  std::vector<double> beyond(polygon.size());
  std::ranges::transform(polygon, beyond.begin(), [&](const Vector3& x) { return side.beyond(x); });
  if (*std::ranges::max_element(beyond) <= kOnSide) {
    return {polygon, {}};
  }
  if (*std::ranges::min_element(beyond) >= -kOnSide) {
    return {{}, polygon};
  }
  std::pair<Polygon, Polygon> parts;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = (i + 1) % polygon.size();
    if (beyond[i] <= kOnSide) {
      parts.first.push_back(polygon[i]);
    }
    if (beyond[i] >= -kOnSide) {
      parts.second.push_back(polygon[i]);
    }
    if (std::min(beyond[i], beyond[next]) < -kOnSide && std::max(beyond[i], beyond[next]) > kOnSide) {
      const Vector3 at = polygon[i] + beyond[i] / (beyond[i] - beyond[next]) * (polygon[next] - polygon[i]);
      parts.first.push_back(at);
      parts.second.push_back(at);
    }
  }
  return parts;
}

FacePart made_part(Eigen::Index face, int box, Polygon corners) {
  FacePart part{face, box, std::move(corners), {}, 0.0, Vector3::Zero()};
  const Polygon& x = part.corners;
  for (std::size_t i = 1; i + 1 < x.size(); ++i) {
    const double area = 0.5 * (x[i] - x[0]).cross(x[i + 1] - x[0]).norm();
    part.area += area;
    part.centroid += area / 3.0 * (x[0] + x[i] + x[i + 1]);
  }
  part.centroid /= part.area > 0 ? part.area : 1.0;
  part.borders.assign(x.size(), 0);
  return part;
}

/// Cuts the faces one after another.
class FaceCutter {
 public:
  FaceCutter(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) : mesh_(mesh), boxes_(boxes) {
    std::ranges::transform(boxes, std::back_inserter(convex_), [](const TargetBox& box) { return ConvexBox(box); });
  }

  void cut(Eigen::Index face) {
    left_.clear();
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
      const Reach reach = reach_of(b, face);
      if (reach == Reach::kNone) {
        continue;
      }
      if (!begun_) {
        begun_ = true;
        left_.push_back({mesh_.corner(face, 0), mesh_.corner(face, 1), mesh_.corner(face, 2)});
      }
      std::vector<Polygon> left;
      for (const Polygon& piece : left_) {
        if (reach == Reach::kWhole) {
          add(face, static_cast<int>(b), piece);
        } else {
          cut(face, b, piece, left);
        }
      }
      left_ = std::move(left);
      if (left_.empty()) {
        break;
      }
    }
    begun_ = false;
  }

  std::vector<FacePart> parts() { return std::move(parts_); }

 private:
  enum class Reach { kNone, kPart, kWhole };

  /// What of a face a box may hold, by the circle about its centroid.
  Reach reach_of(std::size_t b, Eigen::Index face) const {
    const Vector3 centroid = mesh_.centroids().col(face);
    if (boxes_[b].shape == TargetShape::kMask) {
      return holds(boxes_[b], centroid) ? Reach::kWhole : Reach::kNone;
    }
    double radius = 0.0;
    for (int c = 0; c < 3; ++c) {
      radius = std::max(radius, (mesh_.corner(face, c) - centroid).squaredNorm());
    }
    radius = std::sqrt(radius);
    const double distance = convex_[b].distance(convex_[b].own(centroid));
    return distance > radius ? Reach::kNone : distance < -radius - kOnSide ? Reach::kWhole : Reach::kPart;
  }

  void cut(Eigen::Index face, std::size_t b, const Polygon& piece, std::vector<Polygon>& left) {
    const ConvexBox& box = convex_[b];
    const auto in_world = [&](Polygon polygon) {
      std::ranges::transform(polygon, polygon.begin(), [&](const Vector3& x) { return box.world(x); });
      return polygon;
    };
    Polygon inside = piece;
    std::ranges::transform(inside, inside.begin(), [&](const Vector3& x) { return box.own(x); });
    std::vector<Polygon> beyond;
    for (const HalfSpace& side : box.sides()) {
      auto [within, rest] = split(inside, side);
      if (!rest.empty()) {
        beyond.push_back(std::move(rest));
      }
      inside = std::move(within);
      if (inside.empty()) {
        left.push_back(piece);
        return;
      }
    }
    if (!add(face, static_cast<int>(b), in_world(inside))) {
      left.push_back(piece);
      return;
    }
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const Vector3& next = inside[(i + 1) % inside.size()];
      parts_.back().borders[i] = std::ranges::any_of(box.sides(), [&](const HalfSpace& side) {
        return std::abs(side.beyond(inside[i])) <= 2 * kOnSide && std::abs(side.beyond(next)) <= 2 * kOnSide;
      });
    }
    std::ranges::transform(beyond, std::back_inserter(left), in_world);
  }

  bool add(Eigen::Index face, int box, Polygon corners) {
    FacePart part = made_part(face, box, std::move(corners));
    if (part.area < kLeastPart * mesh_.areas()(face)) {
      return false;
    }
    parts_.push_back(std::move(part));
    return true;
  }

  const TriangleMesh& mesh_;
  const std::vector<TargetBox>& boxes_;
  std::vector<ConvexBox> convex_;
  std::vector<Polygon> left_;  // of the face, in no box so far
  bool begun_ = false;
  std::vector<FacePart> parts_;
};

}  // namespace

std::vector<FacePart> face_parts(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  FaceCutter cutter(mesh, boxes);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    cutter.cut(f);
  }
  return cutter.parts();
}

}  // namespace touchfield
