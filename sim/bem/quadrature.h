#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/bem/pair_loops.h"
#include "sim/bem/scheme.h"
#include "sim/core/sincos.h"
#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Normal derivative of the free-space Green's function at its source,
///
///   dg/dn_y (x, y) = (1 - i k r) exp(i k r) n.(x - y) / (4 pi r^3),   g = exp(i k r) / (4 pi r), r = |x - y|
///
/// offset       x - y [m], not zero
/// normal       n, the unit normal at y
/// wavenumber   k + i alpha [1/m]
/// returns      the value [1/m2]
inline Complex double_layer_kernel(const Vector3& offset, const Vector3& normal, const Complex& wavenumber) {
  const double r = offset.norm();
  const double kr = wavenumber.real() * r;
  const SinCos wave = sincos(kr);
  const double damping = std::exp(-wavenumber.imag() * r);
  const double strength = damping * normal.dot(offset) / (4.0 * std::numbers::pi * r * r * r);
  // (1 + alpha r - i k r) (cos kr + i sin kr)
  const double near = 1.0 + wavenumber.imag() * r;
  return {strength * (near * wave.cos + kr * wave.sin), strength * (near * wave.sin - kr * wave.cos)};
}

/// A flat triangle with its geometry.
struct Face {
  Vector3 a;
  Vector3 b;
  Vector3 c;       // corners [m], counter-clockwise seen from the normal's side
  Vector3 normal;  // unit
  double area;     // [m2]
};

/// Signed solid angle of a flat triangle seen from x [sr], positive on the side the normal points to; exact. On the
/// triangle's plane inside its edges it is +-2 pi by the sign of rounding. By that of face_shape.h.
double solid_angle(const Face& face, const Vector3& x);

/// Gradient of the solid angle in x [sr/m], by the loop round the triangle's edges; exact, infinite on an edge.
///
///   grad Omega = loop (x - y) x dy / |x - y|^3
Vector3 solid_angle_gradient(const Face& face, const Vector3& x);

/// Integrals of Layer's kernels over flat faces seen from one point. On faces nearer than seven_below the static part
/// of D and W, the most singular one, is taken in closed form. The closed forms are the solid angle and its gradient.
/// Points integrate the rest. The object holds the points of all faces that were added, so that the kernels are
/// evaluated together. Keep one per thread.
class FaceQuadrature {
 public:
  /// wavenumber   k + i alpha [1/m];  gamma: eta = i gamma [m]
  FaceQuadrature(const Complex& wavenumber, double gamma, const FaceRule& rule);

  /// Starts again at x [m] with unit normal m there.
  void begin(const Vector3& x, const Vector3& m);
  void add(const Face& face);

  /// int K(x, y) dS_y of each face since begin(), in that order; [m] for the single layer, no unit otherwise.
  ///
  /// accuracy   nearer than seven_below: 2e-4 (S), 2e-6 (D), 1.4e-4 (D'), 1.4e-4 (W) of the integral of the kernel's
  ///            magnitude, down to a twentieth of an edge off the face; beyond: 1.5e-3 (W), less of the others
  const std::vector<Complex>& integrals(Layer layer);

 private:
  void add_piece(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& n, double area, int depth);
  void add_point(const Vector3& y, const Vector3& n, double weight);
  void make_static_exact(Layer layer);

  double scale_;  // half wavelengths per metre
  PairConstants<double> constants_;
  FaceRule rule_;
  Vector3 x_ = Vector3::Zero();
  Vector3 m_ = Vector3::UnitZ();
  std::vector<double> px_, py_, pz_, nx_, ny_, nz_, weight_, re_, im_;
  std::vector<std::size_t> ends_;
  std::vector<Face> close_;               // faces whose static part is taken in closed form
  std::vector<std::size_t> close_index_;  // and their numbers
  std::vector<Complex> values_;
};

/// The integrals of a face over itself at its centroid, in closed form round its edges; those of D and D' are 0.
struct SelfIntegrals {
  Complex single;         // S [m]
  Complex hypersingular;  // W, its finite part [1/m]
};

/// accuracy   1e-9 relative for faces up to half a wavelength with angles above 5 degrees, 1e-5 at 1 degree
SelfIntegrals self_integrals(const Face& face, const Complex& wavenumber);

/// Face f of a mesh with its geometry.
Face face_of(const TriangleMesh& mesh, Eigen::Index f);

}  // namespace touchfield
