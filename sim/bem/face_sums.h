#pragma once

#include "sim/bem/pair_loops.h"
#include "sim/core/types.h"

namespace touchfield {

/// Sums over the faces of a body with one point per face,
///
///   y_i = sum over j != i of A_j K(x_i, x_j) x_j,   K one of Layer's kernels, x the centroids,
///
/// pair by pair (layer_sum.h) or by a grid (grid_sum.h).
class FaceSums {
 public:
  FaceSums() = default;
  FaceSums(const FaceSums&) = delete;
  FaceSums& operator=(const FaceSums&) = delete;
  virtual ~FaceSums() = default;

  virtual Eigen::Index size() const = 0;

  /// M x S to M x S; [m] for the single layer, no unit otherwise.
  virtual Eigen::MatrixXcd apply(Layer layer, const Eigen::MatrixXcd& x) const = 0;

  /// The transpose, without conjugation, of kDouble or kBurtonMiller.
  virtual Eigen::MatrixXcd apply_transpose(Layer layer, const Eigen::MatrixXcd& x) const = 0;
};

/// Which layer is the transpose of another, but for the areas.
/// throws   std::invalid_argument for layers other than kDouble and kBurtonMiller
Layer transposed(Layer layer);

}  // namespace touchfield
