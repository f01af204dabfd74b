#pragma once

#include "sim/gpu/cuda/faces.cuh"
#include "sim/gpu/cuda/products.cuh"

namespace touchfield::cuda {

/// Kernels between points and the faces of a surface, one point a face, 0 where they coincide:
///
///   panel(i, c) = factor A_j K(x_i, x_j) / 4 pi,   j = faces[c], or c where that is null;   K of kDouble or kBurtonMiller
///
/// for the points first .. first + rows - 1 of the surface itself.
/// diagonal   null, or M values on the card that stand where j is the point itself
/// panel      rows x columns, ld >= rows
void fill_kernels(const Faces& faces, Layer layer, Differences differences, float factor, int first, int rows,
                  const int* columns, int count, const cuDoubleComplex* diagonal, cuComplex* panel, int ld);

inline constexpr int kFewColumns = 4;

/// Sums over faces for few right-hand sides, kernels made on the way, of kDouble or kBurtonMiller,
///
///   y_i = diagonal_i x_i + factor sum over j != i of A_j K(x_i, x_j) x_j / 4 pi
///
/// or, transposed, with A_i K(x_j, x_i). 256 terms are summed in single precision and these in double, in an order that
/// depends on M alone.
///
/// diagonal   M
/// x, y       M x columns, columns <= kFewColumns, not the same
/// partial    room, kept by the caller
void sum_kernels(const Faces& faces, Layer layer, Differences differences, bool transposed, float factor,
                 const cuDoubleComplex* diagonal, const cuComplex* x, int columns, cuComplex* y,
                 Array<double2>& partial);

/// The double layer at points off the skin, one point a face:
///
///   values(j, s) = sum over f of A_f dg/dn_f (z_j, x_f) pressures(f, s)
///
/// points      3 x J [m] on the card
/// pressures   M x S;  values J x S
void layer_at_points(const Faces& faces, Differences differences, const double* points, int count,
                     const cuComplex* pressures, int columns, cuComplex* values);

}  // namespace touchfield::cuda
