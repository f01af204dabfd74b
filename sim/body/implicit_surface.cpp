#include "sim/body/implicit_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

using Value = SoftBody::Value;

/// Smooth minimum over a blend length k; see SoftBody. k = 0 is the plain minimum.
Value smooth_union(const Value& one, const Value& other, double k) {
  const Value& low = one.distance <= other.distance ? one : other;
  const Value& high = one.distance <= other.distance ? other : one;
  const double gap = high.distance - low.distance;
  if (gap >= k) {
    return low;  // also if there is no other yet, at an infinite distance
  }
  const double h = 1.0 - gap / k;
  const double share = 0.5 * h * h;  // derivative of the correction by the gap: 1/2 where the two are equal
  return {low.distance - k / 6.0 * h * h * h, (1.0 - share) * low.gradient + share * high.gradient};
}

Value smooth_intersection(const Value& one, const Value& other, double k) {
  const Value merged = smooth_union({-one.distance, -one.gradient}, {-other.distance, -other.gradient}, k);
  return {-merged.distance, -merged.gradient};
}

/// Distance from a centre less a radius. At the centre itself any direction will do.
Value ball(const Vector3& from_centre, double radius) {
  const double distance = from_centre.norm();
  return {distance - radius, distance > 0 ? Vector3(from_centre / distance) : Vector3(Vector3::UnitZ())};
}

/// The nearest point of the cone's side lies on the ball about a + t (b - a), where t is that of x moved along the axis
/// against the slope of the side.
Value evaluate(const Cone& cone, const Vector3& x) {
  const Vector3 axis = cone.b - cone.a;
  const double length = axis.norm();
  const double taper = cone.radius_a - cone.radius_b;
  const Vector3 from_a = x - cone.a;
  if (length <= std::abs(taper)) {
    // One ball lies within the other.
    return taper > 0 ? ball(from_a, cone.radius_a) : ball(x - cone.b, cone.radius_b);
  }
  const double along = from_a.dot(axis) / length;
  const double across = std::sqrt(std::max(from_a.squaredNorm() - along * along, 0.0));
  const double slope = taper / std::sqrt(length * length - taper * taper);
  const double t = std::clamp((along - across * slope) / length, 0.0, 1.0);
  return ball(from_a - t * axis, cone.radius_a - t * taper);
}

Value segment(const Vector3& a, const Vector3& b, double radius_a, double radius_b, const Vector3& x) {
  const Vector3 axis = b - a;
  const double t = std::clamp((x - a).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return ball(x - a - t * axis, radius_a + t * (radius_b - radius_a));
}

/// Distance to the nearest point of the triangle less the radius there. The gradient leaves out the change of the
/// radius, a small slope.
Value evaluate(const Plate& plate, const Vector3& x) {
  const Vector3 a = plate.corners.col(0);
  const Vector3 ab = plate.corners.col(1) - a;
  const Vector3 ac = plate.corners.col(2) - a;
  const Vector3 ax = x - a;
  const Vector3 normal = ab.cross(ac);
  const double size = normal.squaredNorm();
  const double u = ax.cross(ac).dot(normal) / size;
  const double v = ab.cross(ax).dot(normal) / size;
  if (u >= 0 && v >= 0 && u + v <= 1) {
    return ball(ax - u * ab - v * ac, plate.radii(0) * (1 - u - v) + plate.radii(1) * u + plate.radii(2) * v);
  }
  Value best{std::numeric_limits<double>::infinity(), Vector3::UnitZ()};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const Value side = segment(plate.corners.col(i), plate.corners.col(j), plate.radii(i), plate.radii(j), x);
    if (side.distance < best.distance) {
      best = side;
    }
  }
  return best;
}

template <class Visit>
void for_each_ball(const SoftPart& part, const Visit& visit) {
  for (const Cone& cone : part.cones) {
    visit(cone.a, cone.radius_a);
    visit(cone.b, cone.radius_b);
  }
  for (const Plate& plate : part.plates) {
    for (int c = 0; c < 3; ++c) {
      visit(Vector3(plate.corners.col(c)), plate.radii(c));
    }
  }
}

}  // namespace

SoftBody::SoftBody(std::vector<SoftPart> parts, std::optional<SoftCut> cut, std::optional<SoftFinish> finish)
    : parts_(std::move(parts)),
      cut_(std::move(cut)),
      lower_(Vector3::Constant(std::numeric_limits<double>::infinity())),
      upper_(-lower_) {
  parts_.erase(std::remove_if(parts_.begin(), parts_.end(),
                              [](const SoftPart& part) { return part.cones.empty() && part.plates.empty(); }),
               parts_.end());
  for (const SoftPart& part : parts_) {
    bounds_.push_back(bounds_of(part));
    for_each_ball(part, [&](const Vector3& centre, double radius) {
      // A union bulges by a sixth of its blend; several may add up at one place.
      const double reach = radius + std::max(part.blend, part.outward_blend);
      lower_ = lower_.cwiseMin(centre - Vector3::Constant(reach));
      upper_ = upper_.cwiseMax(centre + Vector3::Constant(reach));
    });
  }
  if (!lower_.allFinite() || !upper_.allFinite()) {
    throw InputError("soft body: it has no cone and no plate, or one that is not finite");
  }
  if (finish) {
    finished_ = FinishedSkin(*this, 0.5 * finish->least_gap, finish->grid);
  }
}

SoftBody::PartBounds SoftBody::bounds_of(const SoftPart& part) {
  PartBounds bounds{{Vector3::Zero(), 0.0}, {}};
  for (const Cone& cone : part.cones) {
    bounds.shapes.push_back(
        {0.5 * (cone.a + cone.b), 0.5 * (cone.a - cone.b).norm() + std::max(cone.radius_a, cone.radius_b)});
  }
  for (const Plate& plate : part.plates) {
    const Vector3 centre = plate.corners.rowwise().mean();
    bounds.shapes.push_back(
        {centre, (plate.corners.colwise() - centre).colwise().norm().maxCoeff() + plate.radii.maxCoeff()});
  }
  for (const Bound& shape : bounds.shapes) {
    bounds.whole.centre += shape.centre / static_cast<double>(bounds.shapes.size());
  }
  for (const Bound& shape : bounds.shapes) {
    bounds.whole.radius = std::max(bounds.whole.radius, (shape.centre - bounds.whole.centre).norm() + shape.radius);
  }
  // Every union within the part lowers the distance by a sixth of the blend at most.
  bounds.whole.radius += static_cast<double>(bounds.shapes.size() - 1) * part.blend / 6.0;
  return bounds;
}

SoftBody::Value SoftBody::part_at(std::size_t i, const Vector3& x) const {
  const SoftPart& part = parts_[i];
  const std::vector<Bound>& bounds = bounds_[i].shapes;
  Value value{std::numeric_limits<double>::infinity(), Vector3::UnitZ()};
  std::size_t shape = 0;
  const auto add = [&](const auto& next) {
    if (bounds[shape].least(x) < value.distance + part.blend) {
      value = smooth_union(value, evaluate(next, x), part.blend);
    }
    ++shape;
  };
  for (const Cone& cone : part.cones) {
    add(cone);
  }
  for (const Plate& plate : part.plates) {
    add(plate);
  }
  return value;
}

SoftBody::Value SoftBody::at(const Vector3& x) const {
  return finished_ && finished_->covers(x) ? finished_->at(x) : raw_at(x);
}

SoftBody::Value SoftBody::raw_at(const Vector3& x) const {
  Value value{std::numeric_limits<double>::infinity(), Vector3::UnitZ()};
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (bounds_[i].whole.least(x) < value.distance + parts_[i].outward_blend) {
      value = smooth_union(value, part_at(i, x), parts_[i].outward_blend);
    }
  }
  if (cut_) {
    value = smooth_intersection(value, {(x - cut_->point).dot(cut_->normal), cut_->normal}, cut_->blend);
  }
  return value;
}

void SoftBody::project(Points& points, double reach) const {
  constexpr int kMostSteps = 20;
  constexpr double kClose = 1e-10;  // [m]
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Vector3 x = points.col(i);
    Value value = at(x);
    for (int step = 0; step < kMostSteps && std::abs(value.distance) > kClose; ++step) {
      // Where two gradients cancel (the middle of a fillet seen from outside) the step would be endless.
      const double slope = std::max(value.gradient.squaredNorm(), 0.25);
      x -= std::clamp(value.distance / slope, -reach, reach) * value.gradient;
      value = at(x);
    }
    if ((x - points.col(i)).norm() <= 2.0 * reach) {
      points.col(i) = x;
    }
  }
}

}  // namespace touchfield
