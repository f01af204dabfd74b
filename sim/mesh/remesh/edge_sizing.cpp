#include "sim/mesh/remesh/edge_sizing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

EdgeSizing::EdgeSizing(double far, std::vector<SizingZone> zones, double growth)
    : far_(far), zones_(std::move(zones)), growth_(growth) {
  const auto require_length = [](const char* field, double value, bool zero) {
    if (!std::isfinite(value) || value < 0 || (value == 0 && !zero)) {
      throw InputError(fmt::format("{} = {} m must be {} 0 and finite", field, value, zero ? ">=" : ">"));
    }
  };
  require_length("edge_mm.far", far_, false);
  for (const SizingZone& zone : zones_) {
    require_length("edge_mm.near_target", zone.edge, false);
    require_length("edge_mm.within_mm", zone.within, true);
    if (!zone.centre.allFinite()) {
      throw InputError("edge_mm: the centre of a zone must be finite");
    }
  }
  if (!(growth_ >= 0.02 && growth_ <= 0.6)) {
    throw InputError(fmt::format("edge_mm.growth = {} must be 0.02 to 0.6", growth_));
  }
}

double EdgeSizing::at(const Vector3& x) const {
  double edge = far_;
  for (const SizingZone& zone : zones_) {
    edge = std::min(edge, zone.edge + growth_ * std::max(0.0, (x - zone.centre).norm() - zone.within));
  }
  return edge;
}

Eigen::VectorXd EdgeSizing::at(const Points& points) const {
  Eigen::VectorXd edges(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    edges(i) = at(Vector3(points.col(i)));
  }
  return edges;
}

double EdgeSizing::finest() const {
  double edge = far_;
  for (const SizingZone& zone : zones_) {
    edge = std::min(edge, zone.edge);
  }
  return edge;
}

}  // namespace touchfield
