#pragma once

#include <vector>

#include "sim/core/types.h"

namespace touchfield {

/// Edge length asked for within some distance of a point.
struct SizingZone {
  Vector3 centre;  // [m]
  double edge;     // [m], > 0
  double within;   // [m], >= 0
};

/// Wanted edge length h(x) as a function of place:
///
///   h(x) = min(far, min over zones z of edge_z + growth max(0, |x - c_z| - within_z))
///
/// The gradient of h is at most `growth`, so that the edges of neighbouring faces differ by a factor of about
/// 1 + growth.
class EdgeSizing {
 public:
  static constexpr double kGrowth = 0.2;

  /// far      edge length away from every zone [m], > 0
  /// growth   0.02 to 0.6
  /// throws   InputError on a value out of range or not finite
  explicit EdgeSizing(double far, std::vector<SizingZone> zones = {}, double growth = kGrowth);

  double at(const Vector3& x) const;
  Eigen::VectorXd at(const Points& points) const;

  double far() const { return far_; }
  double finest() const;  // least edge length anywhere
  const std::vector<SizingZone>& zones() const { return zones_; }
  double growth() const { return growth_; }

 private:
  double far_;
  std::vector<SizingZone> zones_;
  double growth_;
};

}  // namespace touchfield
