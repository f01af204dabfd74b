#pragma once

#include "sim/acoustics/incident_field.h"
#include "sim/bem/layer_sum.h"
#include "sim/bem/quadrature.h"
#include "sim/field/evaluate.h"
#include "sim/gpu/on_card.h"
#include "tests/support/reference_kernels.h"

namespace touchfield {
inline namespace support {

/// What far_field_on_card makes at kFarDistance, pair by pair.
inline FarField reference_far_field(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                                    const Points& points, const Eigen::MatrixXcd& surface,
                                    const Eigen::MatrixXcd& drive) {
  FarField far{incident_pressure(array, wave, points, drive), Eigen::VectorXd::Zero(points.cols()),
               std::vector<int>(static_cast<std::size_t>(points.cols()))};
  const double scale = half_wavelengths(wave.wavenumber());
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      // Which are near is decided in half wavelengths, and rounded there.
      const Vector3 d = scale * Vector3(points.col(j)) - scale * Vector3(mesh.centroids().col(f));
      const double area = mesh.areas()(f) * scale * scale;
      if (d.x() * d.x() + d.y() * d.y() + d.z() * d.z() < kFarDistance * kFarDistance * area) {
        ++far.near[static_cast<std::size_t>(j)];
        continue;
      }
      const Vector3 offset = points.col(j) - mesh.centroids().col(f);
      const Vector3 normal = mesh.normals().col(f);
      far.pressure.row(j) += mesh.areas()(f) * double_layer_kernel(offset, normal, wave.wavenumber()) * surface.row(f);
      far.winding(j) += mesh.areas()(f) * static_double_layer_kernel(offset, normal);
    }
  }
  return far;
}

/// Points in and around a body, and just off every third face on both sides.
inline Points points_about(const TriangleMesh& mesh, int side) {
  const Vector3 low = mesh.vertices().rowwise().minCoeff();
  const Vector3 size = mesh.vertices().rowwise().maxCoeff() - low;
  const auto thirds = Eigen::seq(0, Eigen::last, 3);
  const Points centroids = mesh.centroids()(Eigen::all, thirds);
  const Points off = 0.1 * mesh.mean_edge() * mesh.normals()(Eigen::all, thirds);
  const Eigen::Index cells = Eigen::Index{1} * side * side * side;
  Points points(3, cells + 2 * centroids.cols());
  for (Eigen::Index i = 0; i < cells; ++i) {
    const Vector3 cell(static_cast<double>(i % side), static_cast<double>(i / side % side),
                       static_cast<double>(i / side / side));
    points.col(i) = low + (2.0 * cell / side - Vector3::Constant(0.49)).cwiseProduct(size);
  }
  points.rightCols(2 * centroids.cols()) << centroids + off, centroids - off;
  return points;
}

/// Any pressures on the skin of the size of the incident ones.
inline Eigen::MatrixXcd skin_pressures(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                                       const Eigen::MatrixXcd& drive) {
  return 1.7 * incident_pressure(array, wave, mesh.centroids(), drive);
}

/// N x S drives.
inline Eigen::MatrixXcd many_drives(Eigen::Index channels, Eigen::Index columns) {
  Eigen::MatrixXcd drive(channels, columns);
  for (Eigen::Index i = 0; i < drive.size(); ++i) {
    drive(i) = std::polar(1.0, 0.37 * static_cast<double>(i * i % 97));
  }
  return drive;
}

}  // namespace support
}  // namespace touchfield
