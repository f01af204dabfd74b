#include "solvers/linear/low_rank.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/QR>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/random_share.h"

namespace touchfield {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

constexpr double kOverlap = 1e-13;  // of a block with those before it
constexpr Index kFewest = 64;       // columns in a sum
constexpr Index kSumRows = 128;     // rows of the sums that stay in the second cache

/// Sums of A's columns at random angles: each column in as many of them as give every sum kFewest columns.
MatrixXcd random_sums(const MatrixXcd& a, Index count, std::mt19937_64& generator) {
  const Index shares = std::min(count, (kFewest * count + a.cols() - 1) / a.cols());
  std::vector<Index> first_sum(static_cast<std::size_t>(a.cols()));
  MatrixXcd angles(shares, a.cols());
  for (Index j = 0; j < a.cols(); ++j) {
    const auto other = static_cast<Index>(random_share(generator) * static_cast<double>(j + 1));
    first_sum[static_cast<std::size_t>(j)] = j % count;
    std::swap(first_sum[static_cast<std::size_t>(j)], first_sum[static_cast<std::size_t>(other)]);
    for (Index i = 0; i < shares; ++i) {
      angles(i, j) = std::polar(1.0, 2.0 * std::numbers::pi * random_share(generator));
    }
  }
  MatrixXcd sums = MatrixXcd::Zero(a.rows(), count);
#pragma omp parallel for schedule(static)
  for (Index begin = 0; begin < a.rows(); begin += kSumRows) {
    const Index rows = std::min(kSumRows, a.rows() - begin);
    for (Index j = 0; j < a.cols(); ++j) {
      for (Index i = 0; i < shares; ++i) {
        const Index sum = (first_sum[static_cast<std::size_t>(j)] + i) % count;
        sums.col(sum).segment(begin, rows) += angles(i, j) * a.col(j).segment(begin, rows);
      }
    }
  }
  return sums;
}

/// Orthonormal columns that span, with the basis to which they are orthogonal, what the columns of y do.
MatrixXcd orthonormal(const MatrixXcd& basis, MatrixXcd y) {
  do {  // where little but rounding was left the columns are not yet orthogonal to the basis
    for (int twice = 0; twice < 2; ++twice) {
      y -= matrix_product(basis, adjoint_product(basis, y));
    }
    const Eigen::HouseholderQR<MatrixXcd> qr(y);
    y = qr.householderQ() * MatrixXcd::Identity(y.rows(), y.cols());
  } while (adjoint_product(basis, y).norm() > kOverlap);
  return y;
}

}  // namespace

LowRank compressed(const MatrixXcd& a, double tolerance, Index block) {
  if (!(tolerance >= 1e-7 && tolerance <= 1.0) || block < 1) {
    throw std::invalid_argument("compressed: the tolerance must be 1e-7 to 1, the block >= 1");
  }
  const double total = a.squaredNorm();
  if (!std::isfinite(total)) {
    throw std::domain_error("compressed: the matrix holds a value that is not finite");
  }
  const Index most = std::min(a.rows(), a.cols());
  LowRank result{MatrixXcd(a.rows(), 0), MatrixXcd(0, a.cols()), 0.0};
  std::vector<MatrixXcd> rows;
  double left = total;
  std::mt19937_64 generator(1);
  while (left > tolerance * tolerance * total && result.rank() < most) {
    const Index found = result.rank();
    const Index width = std::min(block, most - found);
    const MatrixXcd y = orthonormal(result.basis, random_sums(a, width, generator));
    rows.push_back(adjoint_product(y, a));
    left -= rows.back().squaredNorm();
    result.basis.conservativeResize(Eigen::NoChange, found + width);
    result.basis.rightCols(width) = y;
  }
  result.coefficients.resize(result.rank(), a.cols());
  for (Index at = 0; MatrixXcd & own : rows) {
    result.coefficients.middleRows(at, own.rows()) = own;
    at += own.rows();
    own.resize(0, 0);
  }
  result.left_out = total > 0 ? std::sqrt(std::max(left, 0.0) / total) : 0.0;
  return result;
}

}  // namespace touchfield
