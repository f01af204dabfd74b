#include "sim/bem/face_arrays.h"

#include <numbers>

namespace touchfield {

FaceArrays::FaceArrays(const TriangleMesh& mesh, double scale)
    : x(scale * mesh.centroids().row(0)),
      y(scale * mesh.centroids().row(1)),
      z(scale * mesh.centroids().row(2)),
      nx(mesh.normals().row(0)),
      ny(mesh.normals().row(1)),
      nz(mesh.normals().row(2)),
      area(scale * scale * mesh.areas()) {}

double half_wavelengths(const Complex& wavenumber) { return wavenumber.real() / std::numbers::pi; }

template <typename Real>
PairConstants<Real> pair_constants(const Complex& wavenumber, double gamma) {
  return {static_cast<Real>(std::numbers::pi * wavenumber.imag() / wavenumber.real()),
          static_cast<Real>(gamma * half_wavelengths(wavenumber))};
}

template PairConstants<float> pair_constants(const Complex&, double);
template PairConstants<double> pair_constants(const Complex&, double);

}  // namespace touchfield
