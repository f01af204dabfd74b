#pragma once

namespace touchfield {

/// Cholesky factorisation A = L L^H in place (blocks of columns by LAPACK's potrf, the rest by BLAS), n x n, column by
/// column without gaps. Only the lower triangle of `a` is read and written. Scalar is float, double or
/// std::complex<double>.
///
/// returns   false where a pivot is not positive to working precision or not finite; `a` then holds nothing of use
template <typename Scalar>
bool cholesky_factorise(int n, Scalar* a);

/// Overwrites b by A^-1 b for the factor that cholesky_factorise left. Scalar is float or double.
template <typename Scalar>
void cholesky_solve(int n, const Scalar* factor, Scalar* b);

}  // namespace touchfield
