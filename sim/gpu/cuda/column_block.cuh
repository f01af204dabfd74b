#pragma once

#include <functional>
#include <vector>

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// y = A x for a block of columns, both n x columns on the card, column by column without gaps, not overlapping; enqueued
/// on the context's stream.
using BlockProduct = std::function<void(const cuComplex* x, cuComplex* y, int columns)>;

/// A column that is still being worked on; it lies in its block where its slot lies among the slots.
struct Slot {
  int column = 0;         // of the caller's b and x
  int from = 0;           // place in the block before compact()
  int dimension = 0;      // of its Krylov space
  double norm = 0.0;      // ||b||, > 0
  double residual = 1.0;  // least ||b - A x|| / ||b|| so far
};

/// What a kernel says of a column.
struct ColumnStatus {
  double value;
  int extended;   // its space has grown
  int exhausted;  // its space holds its image
};

/// What solvers of A X = B share that work on all columns at once and drop those that are done: residuals, and blocks that
/// hold the columns that are left. x and b are n x S, the blocks have a column a slot. A column is summed by one block of
/// threads in double and in a fixed order, so that no result depends on how many others there are.
class ColumnBlock {
 public:
  explicit ColumnBlock(Context& context) : context_(context), slots_(context), status_(context) {}

  /// Slots of the columns of b that are not zero; sets x to zero, or only the columns whose b is zero if it is a start.
  /// throws   std::domain_error if b holds a value that is not finite; `who` begins its text
  std::vector<Slot> start(const char* who, int n, int columns, const cuComplex* b, cuComplex* x, bool x_is_start);

  /// The slots as the kernels below see them, and status() for as many.
  void upload(const std::vector<Slot>& slots);
  const Slot* slots() const { return slots_.data(); }
  ColumnStatus* status() { return status_.data(); }
  /// Waits for the card; what the kernels have written to status().
  const std::vector<ColumnStatus>& wait();

  /// Moves columns of a block from slot.from to where their slots lie now.
  void compact(int n, cuComplex* block);

  /// r = b - product; status: ||r|| / ||b||. Where that is below slot.residual, x becomes the candidate and direction
  /// r / ||r||; direction may be the product's own memory. Without a product r is b, and x stays.
  void judge(int n, const cuComplex* b, const cuComplex* product, const cuComplex* candidate, cuComplex* x,
             cuComplex* direction);

 private:
  unsigned count() const { return static_cast<unsigned>(slots_.size()); }

  Context& context_;
  Array<Slot> slots_;
  Array<ColumnStatus> status_;
  std::vector<ColumnStatus> said_;
};

/// Takes out the slots that are done; the last ones fill their places, so that few columns move.
template <typename Done>
void drop(std::vector<Slot>& slots, const Done& done) {
  for (std::size_t i = 0; i < slots.size(); ++i) {
    slots[i].from = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < slots.size();) {
    if (done(slots[i])) {
      slots[i] = slots.back();
      slots.pop_back();
    } else {
      ++i;
    }
  }
}

}  // namespace touchfield::cuda
