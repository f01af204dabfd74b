#include "sim/field/evaluate.h"

#include <cmath>
#include <numbers>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/element_integrals.h"
#include "sim/bem/kernel.h"

namespace touchfield {

namespace {

// Distance, in square roots of the area, from which one point stands for a face, as in the scheme itself: the static
// kernel's integral is then within about 1 %.
constexpr double kFarDistance = 5.0;

Face face_of(const TriangleMesh& mesh, Eigen::Index f) {
  return {mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2), mesh.normals().col(f), mesh.areas()(f)};
}

bool is_far(const TriangleMesh& mesh, Eigen::Index f, const Vector3& offset) {
  return offset.squaredNorm() > kFarDistance * kFarDistance * mesh.areas()(f);
}

/// Share of the full solid angle at a point; -1 inside, 0 outside.
bool is_inside(double winding) {
  return winding < -0.5;
}

}  // namespace

FieldValues boundary_integral(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                              const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  FieldValues values{incident_pressure(array, wave, points, drive),
                     std::vector<unsigned char>(static_cast<std::size_t>(points.cols()), 0)};
  const Eigen::MatrixXcd by_face = surface.transpose();  // the inner loop reads a contiguous column
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    const Vector3 x = points.col(j);
    auto sum = values.pressure.row(j);
    double winding = 0.0;
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 offset = x - mesh.centroids().col(f);
      const Vector3 normal = mesh.normals().col(f);
      if (is_far(mesh, f, offset)) {
        winding += mesh.areas()(f) * static_double_layer_kernel(offset, normal);
        sum += mesh.areas()(f) * double_layer_kernel(offset, normal, wave.wavenumber()) * by_face.col(f).transpose();
      } else {
        const Face face = face_of(mesh, f);
        winding += solid_angle(face, x) / (4.0 * std::numbers::pi);
        sum += double_layer_integral(face, x, wave.wavenumber()) * by_face.col(f).transpose();
      }
    }
    values.inside[static_cast<std::size_t>(j)] = is_inside(winding) ? 1 : 0;
  }
  return values;
}

FieldValues evaluate_field(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                           const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  FieldValues values = boundary_integral(mesh, array, wave, points, surface, drive);
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    if (values.inside[static_cast<std::size_t>(j)] != 0) {
      values.pressure.row(j).setZero();
    }
  }
  return values;
}

std::vector<unsigned char> inside_mask(const TriangleMesh& mesh, const Points& points) {
  std::vector<unsigned char> inside(static_cast<std::size_t>(points.cols()), 0);
#pragma omp parallel for schedule(static)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    double winding = 0.0;
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      winding += solid_angle(face_of(mesh, f), points.col(j)) / (4.0 * std::numbers::pi);
    }
    inside[static_cast<std::size_t>(j)] = is_inside(winding) ? 1 : 0;
  }
  return inside;
}

}  // namespace touchfield
