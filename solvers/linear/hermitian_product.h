#pragma once

#include <Eigen/Core>

namespace touchfield {

/// A^H A of an m x n matrix: n x n, Hermitian, both triangles filled. Each block is summed by one thread in a fixed
/// order, so the result is the same to the last bit for every number of threads.
Eigen::MatrixXcd hermitian_product(const Eigen::MatrixXcd& a);

/// A^H B of an m x n and an m x s matrix, n x s; likewise independent of the number of threads.
Eigen::MatrixXcd adjoint_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

/// A B by GEMM on all threads.
/// throws   std::invalid_argument if the sizes do not fit
Eigen::MatrixXcd matrix_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

}  // namespace touchfield
