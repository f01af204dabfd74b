#pragma once

#include <vector>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The nearest place of a skin on a grid round it, to ask thousands of times about hundreds of points.
class SkinGrid {
 public:
  struct Near {
    Vector3 at;      // on the skin [m]
    Vector3 normal;  // there
  };

  /// cell     of the grid [m], > 0
  /// margin   of the grid round the skin [m]
  SkinGrid(const TriangleMesh& skin, double cell, double margin);

  /// The nearest point of the skin to the middle of the cell that x is in, or that is nearest to x.
  const Near& near(const Vector3& x) const {
    const Eigen::Array3i i = ((x - least_) / cell_).array().floor().cwiseMax(0).cwiseMin(last_).cast<int>();
    const int place = (i.z() * count_.y() + i.y()) * count_.x() + i.x();
    return nearest_[static_cast<std::size_t>(place)];
  }

  double cell() const { return cell_; }

 private:
  double cell_;
  Vector3 least_;
  Eigen::Array3i count_;
  Eigen::Array3d last_;  // count - 1
  std::vector<Near> nearest_;
};

}  // namespace touchfield
