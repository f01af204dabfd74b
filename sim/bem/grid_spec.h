#pragma once

#include "sim/bem/kernel_split.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The finest tolerance that sums by a grid are made for: beyond, more points and reach do not make them more accurate.
/// Below kFinestSingleGrid they need double precision.
inline constexpr double kFinestGridTolerance = 1e-8;
inline constexpr double kFinestSingleGrid = 3e-6;

/// What a grid's cost depends on of a body.
struct GridBody {
  Vector3 extent;  // [m]
  double area;     // [m2]
  double faces;
};
GridBody grid_body(const TriangleMesh& mesh);

struct GridChoice {
  GridSpec spec;
  double seconds = 0;  // of one thread for a product with one column, on a processor of 2020
  double memory = 0;   // of the grid and its symbol [bytes]
};

/// The cheapest GridSpec with which a product of D + eta W differs from the direct sum by at most the tolerance:
///
///   |difference| <= tolerance max(|x|, |(D + eta W) x|)   (2-norms)
///
/// Three errors are kept below a half, a quarter and a quarter of it, with r_c = 1.25 beta h / pi, k_c = pi / (1.25 h):
///
///   mollifier      0.018 (k_c / k)^2 exp(-0.93 beta sqrt(1 - (k / k_c)^2))   its spectrum beyond k_c
///   window         2.3 (2 pi / (k h)) exp(-2.03 w)                          its images
///   continuation   0.05 exp(-m (pi - k h) / 2)                              over m steps
///
/// fitted to hands of 3.2 to 0.97 mm edge, a ball and a rod at 40 kHz, h from 0.07 to 0.25 wavelengths. Where eta = i
/// gamma is larger than i / k the first grows with it. What is left free, h, makes the cost small: a finer grid has
/// more points, a coarser one more faces within reach.
///
/// wavenumber   k + i alpha [1/m], k > 0
/// tolerance    from kFinestGridTolerance on
GridChoice choose_grid(const GridBody& body, const Complex& wavenumber, double gamma, double tolerance);

}  // namespace touchfield
