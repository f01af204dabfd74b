#include "sim/bem/chief_operator.h"

#include <utility>

namespace touchfield {

ChiefOperator::ChiefOperator(std::unique_ptr<LinearOperator> b, Eigen::MatrixXcd rows)
    : b_(std::move(b)), rows_(std::move(rows)) {}

Eigen::MatrixXcd ChiefOperator::apply(const Eigen::MatrixXcd& x) const {
  const Eigen::Index m = b_->size();
  Eigen::MatrixXcd y(size(), x.cols());
  y.topRows(m) = b_->apply(x.topRows(m)) + rows_.adjoint() * x.bottomRows(rows_.rows());
  y.bottomRows(rows_.rows()) = rows_ * x.topRows(m);
  return y;
}

Eigen::MatrixXcd ChiefOperator::apply_transpose(const Eigen::MatrixXcd& x) const {
  const Eigen::Index m = b_->size();
  Eigen::MatrixXcd y(size(), x.cols());
  y.topRows(m) = b_->apply_transpose(x.topRows(m)) + rows_.transpose() * x.bottomRows(rows_.rows());
  y.bottomRows(rows_.rows()) = rows_.conjugate() * x.topRows(m);
  return y;
}

}  // namespace touchfield
