#pragma once

#include "sim/gpu/cuda/faces.cuh"

namespace touchfield::cuda {

/// What a sum with one point a face leaves out, as touchfield::NearCorrections: for each pair of faces nearer than the
/// rule's reach the integral over the face minus its one point, by rows. The pairs are the CPU's, to the last one. The
/// integrals are computed in double; their one points as the sums make them, in single precision, so that in a thin gap,
/// where one point is far off, what it loses of its digits goes again. Values are kept in single precision.
///
/// memory   16 bytes a pair, 24 once a transposed product or a column was asked for; some 220 to 240 pairs a face
class NearCorrections {
 public:
  /// faces         outlive this
  /// layer         kDouble or kBurtonMiller
  /// differences   of the sums that these values complete
  NearCorrections(const Faces& faces, Layer layer, const NearRule& rule, Differences differences);

  /// Anew after the faces moved.
  void update();

  int pairs() const { return pairs_; }

  // On the card, for tests: M + 1 begins of rows, and of each pair its column and value.
  const Array<int>& starts() const { return start_; }
  const Array<int>& columns() const { return column_; }
  const Array<cuComplex>& values() const { return value_; }

  /// y += factor N x, or with its transpose; x and y M x columns, columns < 65,536, on the card, not the same.
  void add_product(float factor, const cuComplex* x, cuComplex* y, int columns) const;
  void add_transposed_product(float factor, const cuComplex* x, cuComplex* y, int columns);
  /// panel += factor times rows first .. first + rows - 1 of N; rows x M, ld >= rows
  void add_to_rows(float factor, int first, int rows, cuComplex* panel, int ld) const;
  /// out += factor times the given columns of N; faces: count numbers on the card; M x count, ld >= M
  void add_to_columns(float factor, const int* faces, int count, cuComplex* out, int ld);

 private:
  template <bool kDamped>
  void compute_values();
  template <Layer kLayer, bool kDamped>
  void launch_values();
  void scan(const Array<int>& counts, Array<int>& starts);
  void make_transposed();

  const Faces& faces_;
  Layer layer_;
  NearRule rule_;
  Differences differences_;
  int pairs_ = 0;
  int splits_ = 0;
  bool has_transposed_ = false;
  Array<int> count_, split_count_;  // a row, and a 0 at the end
  Array<int> start_, split_start_;  // M + 1
  Array<int> row_, column_;         // of each pair
  Array<int> split_;                // the pairs whose face is split
  Array<cuComplex> value_;
  Array<int> transposed_start_;                  // M + 1
  Array<int> transposed_row_, transposed_pair_;  // by columns: a pair's row and its number
  Array<char> scratch_;
};

}  // namespace touchfield::cuda
