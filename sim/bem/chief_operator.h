#pragma once

#include <memory>

#include "solvers/linear/linear_operator.h"

namespace touchfield {

/// The square form of CHIEF, [[B, C^H], [C, 0]]: the rows C ask the total field to vanish at points inside the body,
/// their multipliers lambda make room for that.
class ChiefOperator : public LinearOperator {
 public:
  /// b      B, M x M
  /// rows   C, Z x M
  ChiefOperator(std::unique_ptr<LinearOperator> b, Eigen::MatrixXcd rows);

  Eigen::Index size() const override { return b_->size() + rows_.rows(); }
  Eigen::MatrixXcd apply(const Eigen::MatrixXcd& x) const override;
  Eigen::MatrixXcd apply_transpose(const Eigen::MatrixXcd& x) const override;

 private:
  std::unique_ptr<LinearOperator> b_;
  Eigen::MatrixXcd rows_;
};

}  // namespace touchfield
