#pragma once

#include <vector>

#include "sim/acoustics/medium.h"
#include "sim/bem/face_arrays.h"
#include "sim/mesh/triangle_mesh.h"
#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// The system matrix B of scheme `paper`,
///
///   B_ii = 1/2,   B_ij = -A_j dg/dn_j (x_i, x_j),   x the centroids,
///
/// the paper's eq. 1, p/2 - D p = p_inc, with p and grad g constant on each flat face.
///
/// returns   M x M, dimensionless
/// source    Matsubayashi, Makino, Shinoda, EuroHaptics 2020, doi 10.1007/978-3-030-58147-3_45
Eigen::MatrixXcd paper_matrix(const TriangleMesh& mesh, const Wave& wave);

/// Its columns of the given faces, M x K.
Eigen::MatrixXcd paper_columns(const TriangleMesh& mesh, const Wave& wave, const std::vector<Eigen::Index>& faces);

/// The same matrix without storing it: every product computes its entries anew. The reference for what is stored, and
/// the way to a residual after a factorisation has overwritten the matrix. What it needs of the mesh is copied.
class PaperOperator : public LinearOperator {
 public:
  PaperOperator(const TriangleMesh& mesh, const Wave& wave);

  Eigen::Index size() const override { return faces_.size(); }
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

 private:
  FaceArrays faces_;
  Wave wave_;
};

}  // namespace touchfield
