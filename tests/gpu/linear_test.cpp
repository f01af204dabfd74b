#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/gpu/cuda/products.cuh"
#include "solvers/linear/factorisations.h"
#include "tests/gpu/linear_card.h"

namespace touchfield {
namespace {

using GpuLu = LinearCardTest;

TEST_F(GpuLu, AgreesWithTheProcessors) {
  cuda::Lu lu(context());
  for (const int n : {1, 7, 64, 200}) {
    for (const double condition : {2.0, 3e3}) {
      const MatrixXcf a = conditioned(n, condition, 109);
      Matrix factors = put(a);
      lu.factorise(n, factors.data());
      const DenseLuSingle expected{a};
      for (const int columns : {1, 3, 40}) {
        SCOPED_TRACE(testing::Message() << n << " x " << columns << ", " << condition);
        const MatrixXcf b = random(n, columns, 113);
        const auto solved = [&](cublasOperation_t op) {
          Matrix x = put(b);
          lu.solve(op, columns, x.data());
          return get(x, n);
        };
        // Stable backwards: ||b - A x|| <= a few eps ||A|| ||x||, and ||A|| = 1.
        const MatrixXcf plain = solved(CUBLAS_OP_N);
        EXPECT_LE((a * plain - b).norm(), 3e-5F * plain.norm());
        const MatrixXcf transposed = solved(CUBLAS_OP_T);
        EXPECT_LE((a.transpose() * transposed - b).norm(), 3e-5F * transposed.norm());
        const MatrixXcf adjoint = solved(CUBLAS_OP_C);
        EXPECT_LE((a.adjoint() * adjoint - b).norm(), 3e-5F * adjoint.norm());
        const float share = 2e-5F * static_cast<float>(condition);
        EXPECT_LE((plain - expected.solve(b)).norm(), share * plain.norm());
        EXPECT_LE((transposed - expected.solve_transpose(b)).norm(), share * transposed.norm());
        EXPECT_EQ(solved(CUBLAS_OP_N), plain);
      }
    }
  }
}

TEST_F(GpuLu, RefusesWhatHasNoInverse) {
  cuda::Lu lu(context());
  MatrixXcf a = random(64, 64, 127);
  a.row(63) = MatrixXcf::Zero(1, 64);
  Matrix singular = put(a);
  EXPECT_THAT([&] { lu.factorise(64, singular.data()); },
              testing::ThrowsMessage<std::domain_error>("the matrix is singular: pivot 64 is zero"));
  Matrix zero = put(MatrixXcf::Zero(7, 7));
  EXPECT_THAT([&] { lu.factorise(7, zero.data()); },
              testing::ThrowsMessage<std::domain_error>(testing::HasSubstr("the matrix is singular: pivot")));
  a(0, 63) = {0.0F, std::numeric_limits<float>::quiet_NaN()};
  Matrix broken = put(a);
  EXPECT_THAT([&] { lu.factorise(64, broken.data()); },
              testing::ThrowsMessage<std::domain_error>("the matrix holds a value that is not finite"));
}

class GpuHermitian : public LinearCardTest {
 protected:
  HermitianEigen solve_there(cuda::HermitianSolver& solver, const MatrixXcd& a) {
    const auto n = static_cast<int>(a.rows());
    auto vectors = put_as<cuDoubleComplex>(a);
    cuda::Array<double> values(context(), static_cast<std::size_t>(n));
    solver.solve(n, vectors.data(), values.data());
    HermitianEigen found{Eigen::VectorXd(n), MatrixXcd(n, n)};
    values.download(found.values.data(), values.size());
    vectors.download(reinterpret_cast<cuDoubleComplex*>(found.vectors.data()), vectors.size());
    return found;
  }
};

TEST_F(GpuHermitian, AgreesWithTheProcessors) {
  cuda::HermitianSolver solver(context());
  for (const int n : {1, 7, 64, 200}) {
    SCOPED_TRACE(n);
    const MatrixXcd half = in_double(random(n, n, 137));
    const MatrixXcd a = half + half.adjoint();
    const HermitianEigen found = solve_there(solver, a);
    const HermitianEigen expected = hermitian_eigen(a);
    const double size = expected.values.cwiseAbs().maxCoeff();
    EXPECT_LE((found.values - expected.values).cwiseAbs().maxCoeff(), 1e-13 * n * size);
    EXPECT_TRUE(std::is_sorted(found.values.begin(), found.values.end()));
    EXPECT_LE((a * found.vectors - found.vectors * found.values.asDiagonal()).norm(), 1e-13 * n * size);
    EXPECT_LE((found.vectors.adjoint() * found.vectors - MatrixXcd::Identity(n, n)).norm(), 1e-13 * n);
  }
}

using GpuProducts = LinearCardTest;

TEST_F(GpuProducts, MultipliesAsTheProcessorsDo) {
  const int m = 70;
  const int n = 33;
  const int k = 500;
  const MatrixXcf c = random(m, n, 149);
  const std::complex<float> alpha(0.5F, -1.0F);
  const std::complex<float> beta(-0.25F, 2.0F);
  const auto op = [](cublasOperation_t which, const MatrixXcf& a) -> MatrixXcd {
    const MatrixXcd wide = in_double(a);
    return which == CUBLAS_OP_N ? wide : which == CUBLAS_OP_T ? MatrixXcd(wide.transpose()) : MatrixXcd(wide.adjoint());
  };
  for (const cublasOperation_t op_a : {CUBLAS_OP_N, CUBLAS_OP_T, CUBLAS_OP_C}) {
    for (const cublasOperation_t op_b : {CUBLAS_OP_N, CUBLAS_OP_T, CUBLAS_OP_C}) {
      SCOPED_TRACE(testing::Message() << op_a << ", " << op_b);
      const MatrixXcf a = op_a == CUBLAS_OP_N ? random(m, k, 151) : random(k, m, 151);
      const MatrixXcf b = op_b == CUBLAS_OP_N ? random(k, n, 157) : random(n, k, 157);
      const MatrixXcd expected =
          std::complex<double>(alpha) * op(op_a, a) * op(op_b, b) + std::complex<double>(beta) * in_double(c);
      const Matrix a_there = put(a);
      const Matrix b_there = put(b);
      const auto error = [&](cuda::Arithmetic arithmetic) {
        Matrix c_there = put(c);
        cuda::multiply(context(), op_a, op_b, m, n, k, {alpha.real(), alpha.imag()}, a_there.data(),
                       static_cast<int>(a.rows()), b_there.data(), static_cast<int>(b.rows()),
                       {beta.real(), beta.imag()}, c_there.data(), m, arithmetic);
        return (in_double(get(c_there, m)) - expected).norm() / expected.norm();
      };
      EXPECT_LE(error(cuda::Arithmetic::kSingle), 1e-6);
      EXPECT_LE(error(cuda::Arithmetic::kTf32), 2e-3);

      const auto a_wide = put_as<cuDoubleComplex>(in_double(a));
      const auto b_wide = put_as<cuDoubleComplex>(in_double(b));
      auto c_wide = put_as<cuDoubleComplex>(in_double(c));
      cuda::multiply(context(), op_a, op_b, m, n, k, {alpha.real(), alpha.imag()}, a_wide.data(),
                     static_cast<int>(a.rows()), b_wide.data(), static_cast<int>(b.rows()), {beta.real(), beta.imag()},
                     c_wide.data(), m);
      MatrixXcd found(m, n);
      c_wide.download(reinterpret_cast<cuDoubleComplex*>(found.data()), c_wide.size());
      EXPECT_LE((found - expected).norm(), 1e-14 * expected.norm());
    }
  }
}

}  // namespace
}  // namespace touchfield
