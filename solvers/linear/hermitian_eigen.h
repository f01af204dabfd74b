#pragma once

#include <Eigen/Core>

namespace touchfield {

/// A = vectors diag(values) vectors^H.
struct HermitianEigen {
  Eigen::VectorXd values;    ///< n, ascending
  Eigen::MatrixXcd vectors;  ///< n x n, orthonormal columns
};

/// All eigenvalues and eigenvectors of a Hermitian matrix (LAPACK zheevd); only the lower triangle is read.
///
/// accuracy  values to about n eps ||A||
/// throws    std::invalid_argument if it is not square, std::domain_error if it holds a value that is not finite or the
///           iteration fails
HermitianEigen hermitian_eigen(Eigen::MatrixXcd matrix);

}  // namespace touchfield
