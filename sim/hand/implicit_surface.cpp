#include "sim/hand/implicit_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/isosurface.h"
#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/mesh/topology.h"

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

/// The body's surface on a grid about it. Of cubes that it cannot cross all nodes get the distance of the middle, the
/// others are cut into eight.
Isosurface extract(const SoftBody& body, double spacing) {
  constexpr int kBlock = 8;          // nodes along a side of the largest cubes
  constexpr double kSteepest = 1.5;  // bound on the gradient of a SoftBody: 1 plus the slope of a plate's radius
  const Vector3 cells = (body.upper() - body.lower()) / spacing;
  NodeGrid grid{body.lower().array() - 2.0 * spacing, spacing, {}};
  for (int axis = 0; axis < 3; ++axis) {
    grid.count[static_cast<std::size_t>(axis)] = (static_cast<int>((cells(axis) + 5.0) / kBlock) + 1) * kBlock;
  }
  // A node on the surface would make faces without area.
  const auto off_zero = [least = 1e-3 * spacing](double distance) {
    return static_cast<float>(std::abs(distance) < least ? std::copysign(least, distance) : distance);
  };
  std::vector<float> distances(grid.size());
  const auto fill = [&](const auto& fill_part, int i0, int j0, int k0, int side) -> void {
    const double half = 0.5 * (side - 1);
    const double middle = body.distance(grid.origin + spacing * Vector3(i0 + half, j0 + half, k0 + half));
    const bool crossed = std::abs(middle) <= kSteepest * std::sqrt(3.0) * (half + 1.0) * spacing;
    const int step = crossed && side > 1 ? side / 2 : 1;
    for (int k = k0; k < k0 + side; k += step) {
      for (int j = j0; j < j0 + side; j += step) {
        for (int i = i0; i < i0 + side; i += step) {
          if (crossed && side > 1) {
            fill_part(fill_part, i, j, k, step);
          } else {
            distances[grid.index(i, j, k)] = off_zero(middle);
          }
        }
      }
    }
  };
#pragma omp parallel for collapse(3) schedule(dynamic)
  for (int k = 0; k < grid.count[2]; k += kBlock) {
    for (int j = 0; j < grid.count[1]; j += kBlock) {
      for (int i = 0; i < grid.count[0]; i += kBlock) {
        fill(fill, i, j, k, kBlock);
      }
    }
  }
  return isosurface(grid, distances);
}

/// The outer surface alone: pieces that enclose a negative volume are cavities.
Isosurface without_cavities(const Isosurface& soup) {
  const Pieces pieces = find_pieces(soup.points, soup.triangles, sorted_sides(soup.triangles));
  const auto is_body = [](const Piece& piece) { return piece.volume > 0; };
  if (const auto bodies = std::ranges::count_if(pieces.list, is_body); bodies != 1) {
    throw NumericalError(fmt::format("skin: the surface has {} pieces, it must have one", bodies));
  }
  Isosurface outer;
  outer.triangles = faces_where(soup.triangles, [&](Eigen::Index f) {
    return is_body(pieces.list[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])]);
  });
  std::vector<int> used;  // the points in the order in which the faces name them
  std::vector<int> number(static_cast<std::size_t>(soup.points.cols()), -1);
  for (int& v : outer.triangles.reshaped()) {
    int& own = number[static_cast<std::size_t>(v)];
    if (own < 0) {
      own = static_cast<int>(used.size());
      used.push_back(v);
    }
    v = own;
  }
  outer.points = soup.points(Eigen::all, used);
  return outer;
}

/// Mean height of the surface above each face. A quadratic surface through the corners of a face has 3/4 of its height
/// above the centroid as its mean height.
Eigen::VectorXd heights_above(const SoftBody& body, const TriangleMesh& mesh) {
  Eigen::VectorXd heights(mesh.face_count());
#pragma omp parallel for schedule(static)
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    heights(f) = -0.75 * body.distance(mesh.centroids().col(f));
  }
  return heights;
}

/// How far it is from a point of the skin through the body (side -1) or the air (1) to the next skin, `most` if that is
/// farther.
double room(const SoftBody& body, const Vector3& x, double side, double most) {
  constexpr double kFirst = 0.1;       // of `most`
  constexpr double kWide = 0.5;        // of `most`: the distance there from skin that is surely farther
  constexpr double kStep = 0.7;        // of the distance: the function's slope may exceed 1
  constexpr double kLeastStep = 0.03;  // of `most`
  const Vector3 way = side * body.at(x).gradient.normalized();
  if (side * body.distance(x + most * way) > kWide * most) {
    return most;
  }
  double reach = kFirst * most;
  while (reach < most) {
    const double distance = side * body.distance(x + reach * way);
    if (distance <= 0) {
      return reach;
    }
    reach += std::max(kStep * distance, kLeastStep * most);
  }
  return most;
}

/// The edges asked for, none longer than the thickness of the body and the width of its clefts allow.
Eigen::VectorXd possible_edges(const SoftBody& body, const EdgeSizing& sizing, const Points& points) {
  Eigen::VectorXd edges = sizing.at(points);
#pragma omp parallel for schedule(dynamic, 256)
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    for (const double side : {-1.0, 1.0}) {
      if (edges(i) > kAlwaysPossible) {
        const double enough = edges(i) / kOfRoom;
        if (const double there = room(body, points.col(i), side, enough); there < enough) {
          edges(i) = std::max(kOfRoom * there, kAlwaysPossible);
        }
      }
    }
  }
  return edges;
}

}  // namespace

SoftBody::ConeShape::ConeShape(const Cone& of)
    : cone(of),
      axis(of.b - of.a),
      length(axis.norm()),
      bound{0.5 * (of.a + of.b), 0.5 * (of.a - of.b).norm() + std::max(of.radius_a, of.radius_b)} {
  const double taper = of.radius_a - of.radius_b;
  slope = taper / std::sqrt(length * length - taper * taper);
}

/// The nearest point of the cone's side lies on the ball about a + t (b - a), where t is that of x moved along the axis
/// against the slope of the side.
Value SoftBody::ConeShape::at(const Vector3& x) const {
  const double taper = cone.radius_a - cone.radius_b;
  const Vector3 from_a = x - cone.a;
  if (length <= std::abs(taper)) {
    // One ball lies within the other.
    return taper > 0 ? ball(from_a, cone.radius_a) : ball(x - cone.b, cone.radius_b);
  }
  const double along = from_a.dot(axis) / length;
  const double across = std::sqrt(std::max(from_a.squaredNorm() - along * along, 0.0));
  const double t = std::clamp((along - across * slope) / length, 0.0, 1.0);
  return ball(from_a - t * axis, cone.radius_a - t * taper);
}

/// A distance changes by no more than the way.
SoftBody::Extremes SoftBody::ConeShape::within(const Vector3& centre, double radius) const {
  const double middle = at(centre).distance;
  return {middle - radius, middle + radius};
}

SoftBody::PlateShape::PlateShape(const Plate& of)
    : plate(of),
      sides(of.corners(Eigen::all, {1, 2, 0}) - of.corners),
      squared_sides(sides.colwise().squaredNorm()),
      normal(sides.col(2).cross(sides.col(0))),
      size(normal.squaredNorm()),
      bound{of.corners.rowwise().mean(), 0.0} {
  bound.radius = (of.corners.colwise() - bound.centre).colwise().norm().maxCoeff() + of.radii.maxCoeff();
}

/// Distance to the nearest point of the triangle less the radius there. The gradient leaves out the change of the
/// radius, a small slope.
Value SoftBody::PlateShape::at(const Vector3& x) const {
  const Vector3 ax = x - plate.corners.col(0);
  const Vector3 ab = sides.col(0);
  const Vector3 ac = -sides.col(2);
  const double u = ax.cross(ac).dot(normal) / size;
  const double v = ab.cross(ax).dot(normal) / size;
  if (u >= 0 && v >= 0 && u + v <= 1) {
    return ball(ax - u * ab - v * ac, plate.radii(0) * (1 - u - v) + plate.radii(1) * u + plate.radii(2) * v);
  }
  // Of the balls along the sides that of the nearest surface: its direction alone is worked out.
  double least = std::numeric_limits<double>::infinity();
  Vector3 from_centre = ax;
  double radius = plate.radii(0);
  for (int i = 0; i < 3; ++i) {
    const Vector3 from_corner = x - plate.corners.col(i);
    const double t = std::clamp(from_corner.dot(sides.col(i)) / squared_sides(i), 0.0, 1.0);
    const Vector3 from = from_corner - t * sides.col(i);
    const double thick = plate.radii(i) + t * (plate.radii((i + 1) % 3) - plate.radii(i));
    if (const double distance = from.norm() - thick; distance < least) {
      least = distance;
      from_centre = from;
      radius = thick;
    }
  }
  return ball(from_centre, radius);
}

/// The distance to the triangle is within a radius of at() + that radius, and changes by no more than the way.
SoftBody::Extremes SoftBody::PlateShape::within(const Vector3& centre, double radius) const {
  const double middle = at(centre).distance;
  const double spread = plate.radii.maxCoeff() - plate.radii.minCoeff();
  return {middle - radius - spread, middle + radius + spread};
}

SoftBody::Part::Part(const SoftPart& part)
    : cones(part.cones.begin(), part.cones.end()),
      plates(part.plates.begin(), part.plates.end()),
      blend(part.blend),
      outward_blend(part.outward_blend),
      whole{Vector3::Zero(), 0.0} {
  std::vector<Bound> bounds;
  for (const ConeShape& cone : cones) {
    bounds.push_back(cone.bound);
  }
  for (const PlateShape& plate : plates) {
    bounds.push_back(plate.bound);
  }
  for (const Bound& shape : bounds) {
    whole.centre += shape.centre / static_cast<double>(bounds.size());
  }
  for (const Bound& shape : bounds) {
    whole.radius = std::max(whole.radius, (shape.centre - whole.centre).norm() + shape.radius);
  }
  // Every union within the part lowers the distance by a sixth of the blend at most.
  whole.radius += static_cast<double>(bounds.size() - 1) * blend / 6.0;
}

Value SoftBody::Part::at(const Vector3& x) const {
  Value value{std::numeric_limits<double>::infinity(), Vector3::UnitZ()};
  const auto add = [&](const auto& shape) {
    if (shape.bound.least(x) < value.distance + blend) {
      value = smooth_union(value, shape.at(x), blend);
    }
  };
  std::for_each(cones.begin(), cones.end(), add);
  std::for_each(plates.begin(), plates.end(), add);
  return value;
}

SoftBody::SoftBody(std::vector<SoftPart> parts, std::optional<SoftCut> cut, std::optional<SoftFinish> finish)
    : cut_(std::move(cut)), lower_(Vector3::Constant(std::numeric_limits<double>::infinity())), upper_(-lower_) {
  for (const SoftPart& part : parts) {
    if (part.cones.empty() && part.plates.empty()) {
      continue;
    }
    parts_.emplace_back(part);
    for_each_ball(part, [&](const Vector3& centre, double radius) {
      // A union bulges by a sixth of its blend; several may add up at one place.
      const double reach = radius + std::max(part.blend, part.outward_blend);
      lower_ = lower_.cwiseMin(centre - Vector3::Constant(reach));
      upper_ = upper_.cwiseMax(centre + Vector3::Constant(reach));
    });
  }
  require(lower_.allFinite() && upper_.allFinite(),
          "soft body: it has no cone and no plate, or one that is not finite");
  if (finish) {
    const auto distance_of = [](const SoftBody& body) {
      return [&body](const Vector3& x) { return body.distance(x); };
    };
    const auto within_ball = [this](const Vector3& centre, double radius) {
      return [near = within(centre, radius)](const Vector3& x) { return near.distance(x); };
    };
    finished_ = FinishedSkin({lower_, upper_, distance_of(*this), within_ball}, 0.5 * finish->least_gap, finish->grid);
  }
}

/// A union with what is farther by the blend leaves the nearer one as it is. So within the ball a shape counts for
/// nothing once those before it are that much nearer, and those before it count for nothing where it is.
SoftBody SoftBody::within(const Vector3& centre, double radius) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kRounding = 1e-9;  // [m]
  /// Takes `next`, whose values within the ball are `its`, into what was `kept` of those before it, which have
  /// `theirs`.
  const auto join = [](auto& kept, Extremes& theirs, auto&& next, const Extremes& its, double blend,
                       const auto& forget) {
    if (its.least > theirs.most + blend + kRounding) {
      return;
    }
    if (theirs.least > its.most + blend + kRounding) {
      forget();
      theirs = {kInfinity, kInfinity};
    }
    theirs = {std::min(theirs.least, its.least) - blend / 6.0, std::min(theirs.most, its.most)};
    kept.push_back(std::forward<decltype(next)>(next));
  };
  SoftBody body(cut_, lower_, upper_);
  Extremes all{kInfinity, kInfinity};
  for (const Part& part : parts_) {
    if (part.whole.least(centre) - radius > all.most + part.outward_blend + kRounding) {
      continue;
    }
    Part near = part;
    near.cones.clear();
    near.plates.clear();
    const auto forget = [&] {
      near.cones.clear();
      near.plates.clear();
    };
    Extremes own{kInfinity, kInfinity};
    for (const ConeShape& cone : part.cones) {
      join(near.cones, own, cone, cone.within(centre, radius), part.blend, forget);
    }
    for (const PlateShape& plate : part.plates) {
      join(near.plates, own, plate, plate.within(centre, radius), part.blend, forget);
    }
    join(body.parts_, all, std::move(near), own, part.outward_blend, [&] { body.parts_.clear(); });
  }
  return body;
}

SoftBody::Value SoftBody::at(const Vector3& x) const {
  return finished_ && finished_->covers(x) ? finished_->at(x) : raw_at(x);
}

SoftBody::Value SoftBody::raw_at(const Vector3& x) const {
  Value value{std::numeric_limits<double>::infinity(), Vector3::UnitZ()};
  for (const Part& part : parts_) {
    if (part.whole.least(x) < value.distance + part.outward_blend) {
      value = smooth_union(value, part.at(x), part.outward_blend);
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

TriangleMesh skin_mesh(const SoftBody& body, const EdgeSizing& sizing, double coarsest_grid) {
  constexpr int kRounds = 8;
  const Isosurface soup = without_cavities(extract(body, std::min(sizing.far(), coarsest_grid)));
  const RemeshTarget target{[&](const Points& points) { return possible_edges(body, sizing, points); },
                            [&](Points& points) { body.project(points, 0.5 * sizing.far()); }};
  const TriangleMesh mesh = remeshed(soup.points, soup.triangles, target, kRounds);
  constexpr double kMostLift = 0.1;  // of the wanted edge
  return with_mean_height_zero(mesh, heights_above(body, mesh),
                               kMostLift * possible_edges(body, sizing, mesh.vertices()));
}

TriangleMesh skin_mesh(const SoftBody& body, double edge, double coarsest_grid) {
  return skin_mesh(body, EdgeSizing(edge), coarsest_grid);
}

}  // namespace touchfield
