#include "sim/field/evaluate.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/element_integrals.h"
#include "sim/bem/face_arrays.h"
#include "sim/bem/kernel.h"
#include "sim/bem/quadrature.h"

namespace touchfield {

namespace {

// Distance, in square roots of the area, from which one point stands for a face, as in the scheme itself: the static
// kernel's integral is then within about 1 %.
constexpr double kFarDistance = 5.0;
constexpr Eigen::Index kBlock = 256;  // faces a pass: what a pass reads and writes stays in the first cache

bool is_far(const TriangleMesh& mesh, Eigen::Index f, const Vector3& offset) {
  return offset.squaredNorm() > kFarDistance * kFarDistance * mesh.areas()(f);
}

/// Share of the full solid angle at a point; -1 inside, 0 outside.
bool is_inside(double winding) { return winding < -0.5; }

}  // namespace

FieldValues boundary_integral(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                              const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  FieldValues values{incident_pressure(array, wave, points, drive),
                     std::vector<unsigned char>(static_cast<std::size_t>(points.cols()), 0)};
  const FaceArrays faces(mesh);
  const Eigen::MatrixXd surface_re = surface.real();
  const Eigen::MatrixXd surface_im = surface.imag();
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    const Vector3 x = points.col(j);
    std::array<double, kBlock> re{};
    std::array<double, kBlock> im{};
    double winding = 0.0;
    auto sum = values.pressure.row(j);
    for (Eigen::Index first = 0; first < mesh.face_count(); first += kBlock) {
      const Eigen::Index count = std::min(kBlock, mesh.face_count() - first);
      double_layer_weights(faces, x, wave.wavenumber(), first, count, re.data(), im.data());
      for (Eigen::Index i = 0; i < count; ++i) {
        const Eigen::Index f = first + i;
        const Vector3 offset = x - mesh.centroids().col(f);
        if (is_far(mesh, f, offset)) {
          winding += mesh.areas()(f) * static_double_layer_kernel(offset, mesh.normals().col(f));
        } else {
          const Face face = face_of(mesh, f);
          const Complex weight = double_layer_integral(face, x, wave.wavenumber());
          re[static_cast<std::size_t>(i)] = weight.real();
          im[static_cast<std::size_t>(i)] = weight.imag();
          winding += solid_angle(face, x) / (4.0 * std::numbers::pi);
        }
      }
      const Eigen::Map<const Eigen::VectorXd> w_re(re.data(), count);
      const Eigen::Map<const Eigen::VectorXd> w_im(im.data(), count);
      for (Eigen::Index s = 0; s < surface.cols(); ++s) {
        const auto p_re = surface_re.col(s).segment(first, count);
        const auto p_im = surface_im.col(s).segment(first, count);
        sum(s) += Complex(w_re.dot(p_re) - w_im.dot(p_im), w_re.dot(p_im) + w_im.dot(p_re));
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
