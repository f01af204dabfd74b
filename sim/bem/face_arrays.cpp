#include "sim/bem/face_arrays.h"

#include <numbers>

namespace touchfield {

template <typename Real>
FaceArrays<Real>::FaceArrays(const TriangleMesh& mesh, double scale, const Vector3& origin)
    : nx(mesh.normals().row(0).cast<Real>()),
      ny(mesh.normals().row(1).cast<Real>()),
      nz(mesh.normals().row(2).cast<Real>()),
      area(mesh.areas() * scale * scale) {
  const Points places = scale * (mesh.centroids().colwise() - origin);
  x = places.row(0).cast<Real>();
  y = places.row(1).cast<Real>();
  z = places.row(2).cast<Real>();
}

template struct FaceArrays<float>;
template struct FaceArrays<double>;

double half_wavelengths(const Complex& wavenumber) { return wavenumber.real() / std::numbers::pi; }

template <typename Real>
PairConstants<Real> pair_constants(const Complex& wavenumber, double gamma) {
  return {static_cast<Real>(std::numbers::pi * wavenumber.imag() / wavenumber.real()),
          static_cast<Real>(gamma * half_wavelengths(wavenumber))};
}

template PairConstants<float> pair_constants(const Complex&, double);
template PairConstants<double> pair_constants(const Complex&, double);

}  // namespace touchfield
