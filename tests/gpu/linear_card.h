#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "sim/gpu/cuda/block_gmres.cuh"
#include "sim/gpu/cuda/products.cuh"
#include "solvers/linear/linear_operator.h"
#include "tests/gpu/card.h"

namespace touchfield {

/// What the tests of the card's linear algebra share: seeded matrices, copies there and back, residuals in double.
class LinearCardTest : public CardTest {
 protected:
  using MatrixXcd = Eigen::MatrixXcd;
  using MatrixXcf = Eigen::MatrixXcf;
  using Matrix = cuda::Array<cuComplex>;

  static MatrixXcf random(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<float> normal(0.0F, std::sqrt(0.5F));
    return MatrixXcf::NullaryExpr(rows, columns, [&] { return std::complex<float>(normal(engine), normal(engine)); });
  }
  /// Eigenvalues in a circle about 1, of radius a half.
  static MatrixXcf near_identity(Eigen::Index n, unsigned seed) {
    return MatrixXcf::Identity(n, n) + random(n, n, seed) * (0.5F / std::sqrt(static_cast<float>(n)));
  }
  /// Singular values from 1 down to 1 / condition, evenly in their logarithm.
  static MatrixXcf conditioned(Eigen::Index n, double condition, unsigned seed) {
    const auto unitary = [n](unsigned of) {
      return MatrixXcd(random(n, n, of).cast<std::complex<double>>().householderQr().householderQ());
    };
    Eigen::VectorXd values(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      values(i) = std::pow(condition, -static_cast<double>(i) / static_cast<double>(std::max<Eigen::Index>(n - 1, 1)));
    }
    const MatrixXcd product = unitary(seed) * values.asDiagonal() * unitary(seed + 1).adjoint();
    return product.cast<std::complex<float>>();
  }
  static MatrixXcf diagonal(const std::vector<float>& values) {
    const Eigen::VectorXcf as_complex =
        Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size()))
            .cast<std::complex<float>>();
    return as_complex.asDiagonal();
  }

  static MatrixXcd in_double(const MatrixXcf& matrix) { return matrix.cast<std::complex<double>>(); }
  static Product product_here(const MatrixXcf& a) {
    return [wide = in_double(a)](const MatrixXcd& x) { return MatrixXcd(wide * x); };
  }
  /// Of each column, in double.
  static std::vector<double> residuals(const MatrixXcf& a, const MatrixXcf& b, const MatrixXcf& x) {
    const MatrixXcd r = in_double(b) - in_double(a) * in_double(x);
    std::vector<double> found;
    for (Eigen::Index s = 0; s < b.cols(); ++s) {
      const double norm = in_double(b).col(s).norm();
      found.push_back(norm > 0.0 ? r.col(s).norm() / norm : r.col(s).norm());
    }
    return found;
  }

  template <typename Complex, typename Eigens>
  cuda::Array<Complex> put_as(const Eigens& matrix) {
    cuda::Array<Complex> there(context());
    there.upload(reinterpret_cast<const Complex*>(matrix.data()), static_cast<std::size_t>(matrix.size()));
    return there;
  }
  Matrix put(const MatrixXcf& matrix) { return put_as<cuComplex>(matrix); }
  static MatrixXcf get(const Matrix& there, Eigen::Index rows) {
    MatrixXcf matrix(rows, static_cast<Eigen::Index>(there.size()) / rows);
    there.download(reinterpret_cast<cuComplex*>(matrix.data()), there.size());
    return matrix;
  }

  cuda::BlockProduct product_there(const Matrix& a, int n, cuda::Arithmetic arithmetic = cuda::Arithmetic::kSingle) {
    return [this, &a, n, arithmetic](const cuComplex* x, cuComplex* y, int columns, const double*) {
      widths_.push_back(columns);
      cuda::multiply(context(), CUBLAS_OP_N, CUBLAS_OP_N, n, columns, n, {1.0F, 0.0F}, a.data(), n, x, n, {0.0F, 0.0F},
                     y, n, arithmetic);
    };
  }

  struct Solved {
    MatrixXcf x;
    cuda::GmresReport report;
  };
  Solved gmres_there(const MatrixXcf& a, const MatrixXcf& b, const cuda::GmresLimits& limits,
                     const MatrixXcf& start = {}) {
    const int n = static_cast<int>(a.rows());
    const Matrix a_there = put(a);
    const Matrix b_there = put(b);
    const bool started = start.size() > 0;
    Matrix x = started ? put(start) : Matrix(context(), b_there.size());
    widths_.clear();
    cuda::BlockGmres solver(context());
    const cuda::GmresReport report = solver.solve(product_there(a_there, n), n, static_cast<int>(b.cols()),
                                                  b_there.data(), x.data(), limits, started);
    EXPECT_EQ(report.products, static_cast<int>(widths_.size()));
    return {get(x, n), report};
  }

  std::vector<int> widths_;  // of the products asked for
};

}  // namespace touchfield
