#pragma once

#include "sim/gpu/cuda/faces.cuh"

namespace touchfield::cuda {

/// What a sum of D + i gamma W with one point a face leaves out, as touchfield::NearCorrections: for each pair of faces
/// nearer than the rule's reach the integral over the face minus its one point, by rows. The pairs are the CPU's, to
/// the last one. The integrals are computed in double; their one points as the sums make them, in single precision, so
/// that in a thin gap, where one point is far off, what it loses of its digits goes again. Values are kept in single
/// precision.
///
/// memory   20 bytes a pair, some 220 to 240 pairs a face; 16 more while pairs are sorted for transposed products
class NearCorrections {
 public:
  /// faces   outlive this
  NearCorrections(const Faces& faces, const NearRule& rule);

  /// Anew after the faces moved.
  void update();

  int pairs() const { return static_cast<int>(row_.size()); }

  // On the card, for tests: M + 1 begins of rows, and of each pair its column and value.
  const Array<int>& starts() const { return start_; }
  const Array<int>& columns() const { return column_; }
  const Array<cuComplex>& values() const { return value_; }

  /// y -= N x, or N^T x; x and y M x columns, columns < 65,536, on the card, not the same.
  void subtract_product(bool transposed, const cuComplex* x, cuComplex* y, int columns);
  /// panel -= rows first .. first + rows - 1 of N; rows x M, ld >= rows
  void subtract_rows(int first, int rows, cuComplex* panel, int ld) const;

 private:
  void integrate();
  void sort_by_columns();

  const Faces& faces_;
  Context& context_;
  NearRule rule_;
  Array<int> count_{context_};                   // a row, and a 0 at the end; then how many are split
  Array<int> start_{context_};                   // M + 1
  Array<int> row_{context_}, column_{context_};  // of each pair
  Array<cuComplex> value_{context_};
  bool is_sorted_ = false;
  Array<int> order_{context_};         // numbers of pairs: those whose faces are split; once sorted all, by columns
  Array<int> column_start_{context_};  // M + 1, once sorted
};

}  // namespace touchfield::cuda
