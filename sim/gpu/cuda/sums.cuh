#pragma once

#include "sim/gpu/cuda/faces.cuh"

namespace touchfield::cuda {

/// Rows first .. first + rows - 1 of the matrix of a surface's faces with one point a face,
///
///   panel(i, j) = -A_j K(x_i, x_j) / 4 pi, on the diagonal the value given;   K = D, or with miller D + i gamma W
///
/// diagonal   M values on the card
/// list       faces j, `columns` of them, on the card; null: all, columns = M
/// panel      rows x columns, ld >= rows
void fill_kernels(const Faces& faces, bool miller, const cuDoubleComplex* diagonal, int first, int rows,
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

}  // namespace touchfield::cuda
