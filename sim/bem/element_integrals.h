#pragma once

#include "sim/core/types.h"

namespace touchfield {

/// A flat triangle with its geometry.
struct Face {
  Vector3 a;
  Vector3 b;
  Vector3 c;       // corners [m], counter-clockwise seen from the normal's side
  Vector3 normal;  // unit
  double area;     // [m2]
};

/// Signed solid angle of a flat triangle seen from x [sr], positive on the side the normal points to; exact. On the
/// triangle's plane inside its edges it is +-2 pi by the sign of rounding.
///
/// source   van Oosterom & Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125
double solid_angle(const Face& face, const Vector3& x);

/// Gradient of the solid angle in x [sr/m], by the loop round the triangle's edges; exact, infinite on an edge.
///
///   grad Omega = loop (x - y) x dy / |x - y|^3
Vector3 solid_angle_gradient(const Face& face, const Vector3& x);

/// Integral of the double-layer kernel over a flat triangle, at any point off the triangle:
///
///   int dg/dn_y (x, y) dS_y = solid_angle / (4 pi) + int (dg/dn_y - dg0/dn_y) dS_y
///
/// The static part is exact; the rest is bounded and integrated by 7 points on triangles split in four until a piece is
/// smaller than a third of its distance or a small fraction of the wavelength. Relative accuracy 1e-6 for faces up to
/// half a wavelength, at any distance.
Complex double_layer_integral(const Face& face, const Vector3& x, const Complex& wavenumber);

}  // namespace touchfield
