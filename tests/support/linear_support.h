#pragma once

#include <cstdlib>

#include "solvers/linear/gmres.h"

namespace touchfield {
inline namespace support {

inline Eigen::MatrixXcd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::srand(seed);  // Eigen's Random draws from rand()
  return Eigen::MatrixXcd::Random(rows, columns);
}

/// The largest relative residual of a column.
inline double worst_residual(const Eigen::MatrixXcd& product, const Eigen::MatrixXcd& b) {
  return ((product - b).colwise().norm().array() / b.colwise().norm().array()).maxCoeff();
}

/// Refers to the matrix.
inline Product product_with(const Eigen::MatrixXcd& a) {
  return [&a](const Eigen::MatrixXcd& x) -> Eigen::MatrixXcd { return a * x; };
}

}  // namespace support
}  // namespace touchfield
