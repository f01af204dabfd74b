#pragma once

#include "sim/gpu/cuda/faces.cuh"

namespace touchfield::cuda {

/// Points of a surface, interpolation P from them and P^T, as touchfield::CoarseSpace (sim/bem/coarse_space.h) has
/// them, with distances in single precision.
class CoarseSpace {
 public:
  /// faces   outlive this; where they move, P stays
  /// most    points, at most
  /// throws  std::domain_error if it takes more points, or fewer than a face interpolates from
  CoarseSpace(const Faces& faces, int most);

  int size() const { return size_; }
  const int* points() const { return points_.data(); }  // faces, ascending, on the card

  /// c = P^T v, or P^T A v with the areas; v M x columns.
  void gather(bool by_areas, const cuComplex* v, int columns, cuComplex* c) const;
  /// y = from + factor P c, or factor A P c; from and y M x columns, may be the same.
  void add_interpolated(bool by_areas, float factor, const cuComplex* c, int columns, const cuComplex* from,
                        cuComplex* y) const;
  /// matrix = P^T A P, size x size.
  void fill_mass(cuComplex* matrix) const;
  /// Rows first .. first + rows - 1 of a matrix with size() rows: matrix = panel P, panel rows x M.
  void multiply_rows(int first, int rows, const cuComplex* panel, int ld, cuComplex* matrix) const;

 private:
  const Faces& faces_;
  Context& context_;
  int size_ = 0;
  Array<int> points_{context_};
  Array<int> point_{context_};                    // M x kCoarseNeighbours, a face's side by side
  Array<float> weight_{context_};                 // likewise
  Array<int> start_{context_}, entry_{context_};  // of each point, the numbers of its entries in these, ascending
};

}  // namespace touchfield::cuda
