#pragma once

#include <functional>

#include <Eigen/Core>

namespace touchfield {

/// A square complex matrix known by what it does.
class LinearOperator {
 public:
  LinearOperator() = default;
  LinearOperator(const LinearOperator&) = delete;
  LinearOperator& operator=(const LinearOperator&) = delete;
  virtual ~LinearOperator() = default;

  /// n of an n x n operator.
  virtual Eigen::Index size() const = 0;

  /// A X; X is n x S.
  virtual Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const = 0;

  /// A^T X, without conjugation.
  virtual Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const = 0;
};

/// What a solver asks of a linear map: A X for an n x S block X of any number of columns S >= 1.
using Product = std::function<Eigen::MatrixXcd(const Eigen::MatrixXcd&)>;

}  // namespace touchfield
