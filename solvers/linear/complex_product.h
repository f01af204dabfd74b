#pragma once

#include <Eigen/Core>

namespace touchfield {

/// c = a b by the threaded BLAS. c may be neither a nor b.
void multiply(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c);

/// c = a b^H by the threaded BLAS. c may be neither a nor b.
void multiply_by_adjoint(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c);

}  // namespace touchfield
