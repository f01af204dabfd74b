#pragma once

#include <memory>

#include "sim/gpu/cuda/near.cuh"
#include "sim/gpu/cuda/products.cuh"
#include "sim/gpu/cuda/sums.cuh"

namespace touchfield::cuda {

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

  /// Anew after the faces moved; a stored B too.
  void update();

  int size() const { return faces_.size(); }
  /// M values on the card.
  const cuDoubleComplex* diagonal() const { return diagonal_.data(); }
  int near_pairs() const { return near_ ? near_->pairs() : 0; }

  /// Rows first .. first + rows - 1 of B: rows x M on the card, ld >= rows.
  void fill_rows(int first, int rows, cuComplex* panel, int ld) const;
  /// The columns of B of some faces, M x count, of a plain equation; both on the card.
  void fill_columns(const int* faces, int count, cuComplex* columns) const;

  /// Keeps all of B, 8 M^2 bytes.
  void store();
  bool is_stored() const { return is_stored_; }
  void forget();
  /// M x M, column by column, once stored.
  const cuComplex* stored() const { return stored_.data(); }

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
};

}  // namespace touchfield::cuda
