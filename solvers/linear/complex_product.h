#pragma once

#include <Eigen/Core>
#include <cblas.h>

namespace touchfield {

/// c = a op(b) by the threaded BLAS; op is none, the transpose or the adjoint. c may be neither a nor b.
void multiply(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, CBLAS_TRANSPOSE transpose,
              Eigen::MatrixXcd& c);

}  // namespace touchfield
