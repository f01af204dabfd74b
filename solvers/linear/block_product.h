#pragma once

#include <complex>

#include <Eigen/Core>

namespace touchfield {

/// c = a^T b without conjugation, by GEMM; inside a parallel region on the calling thread alone.
///
/// a   the first k rows and p columns of it count
/// b   k x s, its columns `stride` apart
/// c   p x s at the head of it, overwritten
template <typename Real>
void transposed_product(const Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& a, Eigen::Index k,
                        Eigen::Index p, const std::complex<Real>* b, Eigen::Index stride, Eigen::Index s,
                        Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& c);

}  // namespace touchfield
