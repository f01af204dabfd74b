#pragma once

#include <memory>

#include "sim/gpu/cuda/faces.cuh"
#include "sim/gpu/cuda/grid_sums.cuh"
#include "sim/gpu/cuda/products.cuh"

namespace touchfield::cuda {

/// Rows of a matrix of faces: from `first` on, of all faces or of a list on the card.
struct RowRange {
  int first, count;
  const int* list = nullptr;

  __device__ int face(int row) const { return list != nullptr ? list[first + row] : first + row; }
};

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
  /// panel -= rows of N; rows x M, ld >= rows
  void subtract_rows(const RowRange& rows, cuComplex* panel, int ld) const;

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

/// Rows of the matrix of a surface's faces with one point a face,
///
///   panel(i, j) = -A_j K(x_i, x_j) / 4 pi, on the diagonal the value given;   K = D, or with miller D + i gamma W
///
/// diagonal   M values on the card
/// list       faces j, `columns` of them, on the card; null: all, columns = M
/// panel      rows x columns, ld >= rows
void fill_kernels(const Faces& faces, bool miller, const cuDoubleComplex* diagonal, const RowRange& rows,
                  const int* list, int columns, cuComplex* panel, int ld);

inline constexpr int kFewColumns = 4;

/// y = the same matrix, or its transpose, times x, for few columns, kernels made on the way. 256 terms are summed in
/// single precision and these in double, in an order that depends on M alone.
///
/// x, y       M x columns, columns <= kFewColumns, not the same
/// partial    room, kept by the caller
/// throws     std::invalid_argument with more columns, or none
void sum_kernels(const Faces& faces, bool miller, bool transposed, const cuDoubleComplex* diagonal, const cuComplex* x,
                 int columns, cuComplex* y, Array<double2>& partial);

/// What is solved, B = diagonal - K with K the sum over faces, as ScatteringSystem has it.
enum class Equation {
  kPaper,           // K = D, one point a face; diagonal 1/2
  kPaperCorrected,  // the same with the diagonal of the static Gauss identity
  kBurtonMiller,    // K = D + i gamma W, near faces integrated; diagonal 1/2 - i gamma W over a face itself
};

struct BoundaryOptions {
  NearRule rule;                                    // of kBurtonMiller
  std::size_t panel_bytes = std::size_t{4} << 30U;  // of rows that products with many columns make at once
};

/// B of a surface on the card, M x M: stored in single precision, or made anew in every product.
///
/// accuracy   of an entry 1e-6 of the row's largest: differences of places are formed in double
class Boundary {
 public:
  /// faces   outlive this
  Boundary(const Faces& faces, Equation equation, const BoundaryOptions& options = {});

  /// Anew after the faces moved; a stored B too. What products went through is forgotten.
  void update();

  int size() const { return faces_.size(); }
  /// M values on the card.
  const cuDoubleComplex* diagonal() const { return diagonal_.data(); }
  int near_pairs() const { return near_ ? near_->pairs() : 0; }

  /// Rows of B: rows x M on the card, ld >= rows.
  void fill_rows(const RowRange& rows, cuComplex* panel, int ld) const;
  /// The columns of B of some faces, M x count, of a plain equation; both on the card.
  void fill_columns(const int* faces, int count, cuComplex* columns) const;

  /// Keeps all of B, 8 M^2 bytes.
  void store();
  bool is_stored() const { return is_stored_; }
  void forget();
  /// M x M, column by column, once stored.
  const cuComplex* stored() const { return stored_.data(); }

  /// Products of a B that is not stored go through a grid from now on; none: not any more.
  void go_through(GridSums* grid) { grid_ = grid; }

  /// y = B x or B^T x, M x columns on the card, not the same; the first `rough` columns in TF32, the others in single
  /// precision. Made anew, for up to kFewColumns columns the sums are in single precision over 256 faces and in double
  /// beyond; for more, rows are made in panels and multiplied, smaller ones where memory is short.
  void apply(bool transposed, const cuComplex* x, cuComplex* y, int columns, int rough);

 private:
  void make_diagonal();
  int make_panel();

  const Faces& faces_;
  Context& context_;
  Equation equation_;
  BoundaryOptions options_;
  std::unique_ptr<NearCorrections> near_;  // of kBurtonMiller
  Array<cuDoubleComplex> diagonal_;
  bool is_stored_ = false;
  Array<cuComplex> stored_{context_}, panel_{context_};
  Array<double2> partial_{context_};
  GridSums* grid_ = nullptr;
};

}  // namespace touchfield::cuda
