#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace touchfield {

/// y = A x for a real sparse matrix and complex columns, summed in double, rows shared among threads. y gets the size
/// that it must have. Real is float or double.
template <typename Real>
void sparse_product(const Eigen::SparseMatrix<Real, Eigen::RowMajor>& a, const Eigen::MatrixXcd& x,
                    Eigen::MatrixXcd& y);

}  // namespace touchfield
