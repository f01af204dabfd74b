#pragma once

#include <Eigen/Core>

#include "sim/bem/scattering_system.h"
#include "solvers/linear/dense_lu.h"

namespace touchfield {

/// The transfer matrix H of a body, p = H q, M x N [Pa], never formed: B^-1 by its LU factors, b and B_c stored, all in
/// single precision,
///
///   H = B^-1 b,   of burton_miller_polished   H = (1 - B_c)^2 B^-1 b + (2 - B_c) e
///
/// For a few products with one vector at a time, which cost 8 M (M + N) operations each, twice that if polished,
/// against 8 M^2 N for H itself.
///
/// accuracy   1e-4 of the largest pressure, where B is well conditioned: that of incident_matrix_single
class FactoredTransfer {
 public:
  /// Factorises B.
  /// throws   std::domain_error if B is singular or holds a value that is not finite
  explicit FactoredTransfer(const ScatteringSystem& system);

  /// Where the array is to the body; to be called before a product.
  ///
  /// system   the one that was factorised, or one with the same vertices
  void face(const ScatteringSystem& system, const TransducerArray& array);

  /// H q, M.
  Eigen::VectorXcf pressure(const Eigen::VectorXcf& q) const;

  /// H^H v, N.
  Eigen::VectorXcf sent_back(const Eigen::VectorXcf& v) const;

 private:
  Eigen::Index faces_;
  DenseLuSingle lu_;
  Eigen::MatrixXcf polisher_;  // 1 - B_c, empty where nothing is polished
  Eigen::MatrixXcf b_;
  Eigen::MatrixXcf incident_;  // e, likewise
};

}  // namespace touchfield
