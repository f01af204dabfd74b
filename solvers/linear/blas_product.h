#pragma once

#include <Eigen/Core>

namespace touchfield {

/// What is multiplied: the matrix itself, its transpose, or its adjoint.
enum class Op { kPlain, kTransposed, kAdjoint };

/// c = op(a) op(b) by GEMM: on all threads, inside a parallel region on the calling one alone. c is neither a nor b.
void multiply(Op op_a, const Eigen::Ref<const Eigen::MatrixXcd>& a, Op op_b,
              const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::Ref<Eigen::MatrixXcd> c);
void multiply(Op op_a, const Eigen::Ref<const Eigen::MatrixXcf>& a, Op op_b,
              const Eigen::Ref<const Eigen::MatrixXcf>& b, Eigen::Ref<Eigen::MatrixXcf> c);

/// y = op(a) x + beta y by GEMV, likewise.
void multiply(Op op, const Eigen::Ref<const Eigen::MatrixXcd>& a, const Eigen::Ref<const Eigen::VectorXcd>& x,
              double beta, Eigen::Ref<Eigen::VectorXcd> y);
void multiply(Op op, const Eigen::Ref<const Eigen::MatrixXcf>& a, const Eigen::Ref<const Eigen::VectorXcf>& x,
              float beta, Eigen::Ref<Eigen::VectorXcf> y);

/// c = a b and c = a b^H; c gets their size.
void multiply(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c);
void multiply_by_adjoint(const Eigen::MatrixXcd& a, const Eigen::Ref<const Eigen::MatrixXcd>& b, Eigen::MatrixXcd& c);

/// A B.
/// throws   std::invalid_argument if the sizes do not fit
Eigen::MatrixXcd matrix_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

/// A^H A of an m x n matrix: n x n, Hermitian, both triangles filled. Each block is summed by one thread in a fixed
/// order, so the result is the same to the last bit for every number of threads.
Eigen::MatrixXcd hermitian_product(const Eigen::MatrixXcd& a);

/// A^H B of an m x n and an m x s matrix, n x s; likewise independent of the number of threads.
Eigen::MatrixXcd adjoint_product(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);

}  // namespace touchfield
