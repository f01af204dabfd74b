#pragma once

#include <optional>
#include <vector>

#include "sim/body/finished_skin.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A ball that glides along a segment, from radius to radius: a tapered capsule. Its distance function is exact.
struct Cone {
  Vector3 a;
  Vector3 b;
  double radius_a;  // [m]
  double radius_b;
};

/// A ball that glides over a triangle, its radius linear between the corners: a thick plate with round rims.
struct Plate {
  Eigen::Matrix3d corners;  // as columns [m]
  Vector3 radii;            // [m]
};

/// Cones and plates that blend into each other.
struct SoftPart {
  std::vector<Cone> cones;
  std::vector<Plate> plates;
  double blend = 0;          // [m], among themselves: fillets of about this size
  double outward_blend = 0;  // [m], with the parts before this one
};

/// Flat end of a body: cuts off what lies beyond the point along the normal, with a rim rounded over `blend` [m].
struct SoftCut {
  Vector3 point;
  Vector3 normal;
  double blend;
};

/// What is done to the union of the parts; see FinishedSkin.
struct SoftFinish {
  double least_gap;  // narrower gaps are filled [m]
  double grid;       // the skin is smoothed at about this length [m]
};

/// A body bounded by a smooth surface: the smooth union of soft parts.
///
/// Its function is negative inside, about the signed distance [m] near the surface, and has gradients of length at most
/// about 1. The union of d1 and d2 with blend k is min(d1, d2) - k/6 max(1 - |d1 - d2|/k, 0)^3, which is twice
/// continuously differentiable; surfaces nearer than k/3 to each other merge.
class SoftBody {
 public:
  using Value = ImplicitValue;

  /// finish   without one, the union is taken as it is
  /// throws   InputError if there is no cone and no plate
  explicit SoftBody(std::vector<SoftPart> parts, std::optional<SoftCut> cut = std::nullopt,
                    std::optional<SoftFinish> finish = std::nullopt);

  Value at(const Vector3& x) const;
  double distance(const Vector3& x) const { return at(x).distance; }

  /// Moves points within `reach` [m] of the surface onto it along the gradient, to 1e-9 m where the surface is smooth.
  void project(Points& points, double reach) const;

  /// A box around the body.
  Vector3 lower() const { return lower_; }
  Vector3 upper() const { return upper_; }

 private:
  /// A ball that no point of a shape is outside of: saves evaluating what is far away.
  struct Bound {
    Vector3 centre;
    double radius;
    double least(const Vector3& x) const { return (x - centre).norm() - radius; }
  };
  struct PartBounds {
    Bound whole;
    std::vector<Bound> shapes;  // cones, then plates
  };
  static PartBounds bounds_of(const SoftPart& part);
  Value part_at(std::size_t i, const Vector3& x) const;
  Value raw_at(const Vector3& x) const;

  std::vector<SoftPart> parts_;
  std::vector<PartBounds> bounds_;
  std::optional<SoftCut> cut_;
  Vector3 lower_;
  Vector3 upper_;
  std::optional<FinishedSkin> finished_;
};

}  // namespace touchfield
