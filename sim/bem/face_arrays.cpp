#include "sim/bem/face_arrays.h"

#include <cmath>

#include "sim/bem/kernel.h"

namespace touchfield {

FaceArrays::FaceArrays(const TriangleMesh& mesh)
    : x(mesh.centroids().row(0)),
      y(mesh.centroids().row(1)),
      z(mesh.centroids().row(2)),
      nx(mesh.normals().row(0)),
      ny(mesh.normals().row(1)),
      nz(mesh.normals().row(2)),
      area(mesh.areas()) {}

void double_layer_weights(const FaceArrays& faces, const Vector3& point, const Complex& wavenumber, Eigen::Index first,
                          Eigen::Index count, double* re, double* im) {
  const double* x = faces.x.data() + first;
  const double* y = faces.y.data() + first;
  const double* z = faces.z.data() + first;
  const double* nx = faces.nx.data() + first;
  const double* ny = faces.ny.data() + first;
  const double* nz = faces.nz.data() + first;
  const double* area = faces.area.data() + first;
  const double px = point.x();
  const double py = point.y();
  const double pz = point.z();
  const double k = wavenumber.real();
  const double alpha = wavenumber.imag();
#pragma omp simd
  for (Eigen::Index j = 0; j < count; ++j) {
    const double dx = px - x[j];
    const double dy = py - y[j];
    const double dz = pz - z[j];
    const double r = std::sqrt(dx * dx + dy * dy + dz * dz);
    const double along = nx[j] * dx + ny[j] * dy + nz[j] * dz;
    double_layer_kernel(r, along, k, alpha, area[j], re[j], im[j]);
  }
  if (alpha != 0) {  // apart, since exp keeps the loop above from SIMD
    for (Eigen::Index j = 0; j < count; ++j) {
      const double damping = std::exp(-alpha * (point - Vector3(x[j], y[j], z[j])).norm());
      re[j] *= damping;
      im[j] *= damping;
    }
  }
}

}  // namespace touchfield
