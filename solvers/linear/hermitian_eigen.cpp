#include "solvers/linear/hermitian_eigen.h"

#include <complex>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

extern "C" {
// NOLINTNEXTLINE(readability-identifier-naming): LAPACK's own name; the trailing lengths are Fortran's for characters.
void zheevd_(const char* job, const char* triangle, const int* n, std::complex<double>* a, const int* lda, double* w,
             std::complex<double>* work, const int* lwork, double* rwork, const int* lrwork, int* iwork,
             const int* liwork, int* info, std::size_t job_length, std::size_t triangle_length);
}

namespace touchfield {

HermitianEigen hermitian_eigen(Eigen::MatrixXcd matrix) {
  if (matrix.rows() != matrix.cols() || matrix.rows() > std::numeric_limits<int>::max() / 2) {
    throw std::invalid_argument("hermitian_eigen: the matrix must be square");
  }
  const Eigen::MatrixXcd& a = matrix;
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    if (!a.col(j).tail(a.rows() - j).allFinite()) {
      throw std::domain_error("hermitian_eigen: the matrix holds a value that is not finite");
    }
  }
  HermitianEigen result{Eigen::VectorXd(matrix.rows()), std::move(matrix)};
  const int n = static_cast<int>(result.values.size());
  if (n == 0) {
    return result;
  }
  const char vectors = 'V';
  const char lower = 'L';
  int info = 0;
  const int query = -1;
  std::complex<double> work_size = 0;
  double real_size = 0;
  int integer_size = 0;
  zheevd_(&vectors, &lower, &n, result.vectors.data(), &n, result.values.data(), &work_size, &query, &real_size, &query,
          &integer_size, &query, &info, 1, 1);
  const int work_length = static_cast<int>(work_size.real());
  const int real_length = static_cast<int>(real_size);
  std::vector<std::complex<double>> work(static_cast<std::size_t>(work_length));
  std::vector<double> real_work(static_cast<std::size_t>(real_length));
  std::vector<int> integer_work(static_cast<std::size_t>(integer_size));
  zheevd_(&vectors, &lower, &n, result.vectors.data(), &n, result.values.data(), work.data(), &work_length,
          real_work.data(), &real_length, integer_work.data(), &integer_size, &info, 1, 1);
  if (info != 0) {
    throw std::domain_error("hermitian_eigen: the iteration did not converge");
  }
  return result;
}

}  // namespace touchfield
