#pragma once

#include <cstdint>
#include <vector>

#include "sim/bem/quadrature.h"

namespace touchfield {

/// The part that a sum with one point per face leaves out, by rows. For each pair of faces nearer than the rule's reach
/// it is the integral over the face minus its one-point value.
///
/// memory   20 bytes per pair, 12 in single precision; some 220 pairs per face with FaceRule's distances, 240 on a
///          whole hand
class NearCorrections {
 public:
  enum class Numbers { kDouble, kSingle };  // that are kept; they are made in double

  NearCorrections(const TriangleMesh& mesh, const Complex& wavenumber, double gamma, Layer layer, const FaceRule& rule,
                  Numbers numbers = Numbers::kDouble);

  Eigen::Index size() const { return static_cast<Eigen::Index>(start_.size()) - 1; }
  std::size_t pairs() const { return columns_.size(); }

  /// y += factor N x
  void add_product(const Complex& factor, const Eigen::MatrixXcd& x, Eigen::MatrixXcd& y) const;
  /// y += factor N^T x
  void add_transposed_product(const Complex& factor, const Eigen::MatrixXcd& x, Eigen::MatrixXcd& y) const;
  /// matrix += factor N
  template <typename Real>
  void add_to(const Complex& factor, Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>& matrix) const;
  /// columns += factor times the given columns of N; one column of `columns` for each face, in their order
  void add_columns(const Complex& factor, const std::vector<Eigen::Index>& faces, Eigen::MatrixXcd& columns) const;

 private:
  /// work(the values that are kept)
  template <typename Work>
  void with_values(const Work& work) const {
    singles_.empty() ? work(values_) : work(singles_);
  }

  std::vector<std::size_t> start_;  // M + 1
  std::vector<std::int32_t> columns_;
  std::vector<Complex> values_;  // one of these two
  std::vector<std::complex<float>> singles_;
};

}  // namespace touchfield
