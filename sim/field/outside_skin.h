#pragma once

#include "sim/acoustics/transducer_array.h"
#include "sim/field/gram.h"
#include "sim/mesh/query/skin_patches.h"

namespace touchfield {

/// The skin outside the target, which is to stay silent. A rigid wall in the way of sound has twice its incident pressure at most. Skin that
/// is not solved thus counts by 2 |p_inc|^2, between that of skin in the shade and that of lit skin.
struct OutsideSkin {
  Eigen::VectorXd faces{};  // M: 1 on faces of the solving mesh that are skin, else 0; empty: all are
  SkinPatches beyond{};     // skin that is not solved, by its incident pressure
  TransducerArray array{};  // in the frame of `beyond`

  /// w_Z A of the faces outside, 0 of the target's and of those that are no skin, M.
  Eigen::VectorXd face_weights(const Eigen::VectorXd& areas, const Target& target, double outside_weight) const;

  /// 2 w_Z A of the patches, J.
  Eigen::VectorXd beyond_weights(double outside_weight) const;

  /// p_inc of every channel at unit drive on the patches, J x N [Pa].
  Eigen::MatrixXcf beyond_pressure_single(const Wave& wave) const;

  /// sqrt(2 w_Z A_j) p_inc(x_j), J x N [Pa m]: rows of R of a SkinProblem.
  Eigen::MatrixXcd beyond_rows(const Wave& wave, double outside_weight) const;

  /// w of the rows of B and G in the paper's misfit: row_weights, 0 of faces that are no skin.
  Eigen::VectorXd misfit_weights(FaceWeights faces, const Eigen::VectorXd& areas, Eigen::Index rows) const;

  /// The contribution of skin beyond to G^H diag(w) G, N x N. As `faces` says, w_j is A_j over the mean area of the
  /// solved faces, or the number of faces that a patch stands for. Empty if there is no such skin.
  Eigen::MatrixXcd beyond_gram(FaceWeights faces, const Wave& wave, double mean_area) const;
};

}  // namespace touchfield
