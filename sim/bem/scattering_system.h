#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/bem/scheme.h"
#include "sim/mesh/triangle_mesh.h"
#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// Scattering by a sound-hard body, B p = G q, in one scheme.
class ScatteringSystem {
 public:
  ScatteringSystem(TriangleMesh mesh, const Wave& wave, Scheme scheme);

  const TriangleMesh& mesh() const { return mesh_; }
  const Wave& wave() const { return wave_; }
  Scheme scheme() const { return scheme_; }
  Eigen::Index size() const { return mesh_.face_count(); }

  /// The right-hand side of every channel at unit drive, M x N [Pa].
  Eigen::MatrixXcd right_hand_sides(const TransducerArray& array) const;

  /// B, M x M, stored.
  Eigen::MatrixXcd matrix() const;

  /// The columns of B of the given faces, M x K.
  Eigen::MatrixXcd columns(const std::vector<Eigen::Index>& faces) const;

  /// B without storing it.
  const LinearOperator& reference_operator() const { return *reference_; }

 private:
  TriangleMesh mesh_;
  Wave wave_;
  Scheme scheme_;
  std::unique_ptr<LinearOperator> reference_;
};

/// Solves B p = b for many right-hand sides.
class ScatteringSolver {
 public:
  ScatteringSolver() = default;
  ScatteringSolver(const ScatteringSolver&) = delete;
  ScatteringSolver& operator=(const ScatteringSolver&) = delete;
  virtual ~ScatteringSolver() = default;

  /// B^-1 b, M x S.
  virtual Eigen::MatrixXcd solve(const Eigen::MatrixXcd& b) const = 0;
  /// B^-T b, without conjugation.
  virtual Eigen::MatrixXcd solve_transpose(const Eigen::MatrixXcd& b) const = 0;
  /// Estimate of the reciprocal condition number of B in the 1-norm; NaN if this solver has none.
  virtual double reciprocal_condition() const = 0;
  /// What it is, e.g. "LU, double".
  virtual std::string description() const = 0;
};

/// Dense LU in double precision. Memory: one M x M complex matrix.
/// throws   NumericalError if B is singular or holds a value that is not finite
std::unique_ptr<ScatteringSolver> factorise_dense(const ScatteringSystem& system);

/// Largest relative residual over the columns, max_s ||B p_s - b_s|| / ||b_s||, by the reference operator.
double relative_residual(const ScatteringSystem& system, const Eigen::MatrixXcd& p, const Eigen::MatrixXcd& b);

}  // namespace touchfield
