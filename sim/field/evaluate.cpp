#include "sim/field/evaluate.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/element_integrals.h"
#include "sim/bem/face_arrays.h"
#include "sim/bem/pair_loops.h"
#include "sim/bem/quadrature.h"

namespace touchfield {

namespace {

// Distance, in square roots of the area, from which one point stands for a face, as in the scheme itself: the static
// kernel's integral is then within about 1 %.
constexpr double kFarDistance = 5.0;
constexpr Eigen::Index kBlock = 256;  // faces a pass: what a pass reads and writes stays in the first cache

/// Share of the full solid angle at a point; -1 inside, 0 outside.
bool is_inside(double winding) { return winding < -0.5; }

}  // namespace

FieldValues boundary_integral(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                              const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  FieldValues values{incident_pressure(array, wave, points, drive),
                     std::vector<unsigned char>(static_cast<std::size_t>(points.cols()), 0)};
  const double scale = half_wavelengths(wave.wavenumber());
  const FaceArrays<double> faces(mesh, scale);
  const auto constants = pair_constants<double>(wave.wavenumber(), 0.0);
  const Eigen::VectorXd reach_squared = kFarDistance * kFarDistance * faces.area;
  const Eigen::VectorXd weights = faces.area / (4.0 * std::numbers::pi);
  const Eigen::MatrixXd weighted_re = weights.asDiagonal() * surface.real();
  const Eigen::MatrixXd weighted_im = weights.asDiagonal() * surface.imag();
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    const Vector3 x = points.col(j);
    const PairPoint<double> at{scale * x.x(), scale * x.y(), scale * x.z(), 0.0, 0.0, 0.0};
    std::array<double, kBlock> re{};
    std::array<double, kBlock> im{};
    std::array<int, kBlock> near{};
    double winding = 0.0;
    auto sum = values.pressure.row(j);
    for (Eigen::Index first = 0; first < mesh.face_count(); first += kBlock) {
      const auto count = static_cast<int>(std::min(kBlock, mesh.face_count() - first));
      pair_loops_of<double>().values(Layer::kDouble, constants, at, faces.sources(first), count, re.data(), im.data());
      const int found =
          pair_loops().near_sources(at, faces.sources(first), reach_squared.data() + first, count, near.data());
      int begin = 0;  // of the far faces after the last near one
      for (int i = 0; i < found; ++i) {
        const auto n = static_cast<std::size_t>(near[static_cast<std::size_t>(i)]);
        const Eigen::Index f = first + near[static_cast<std::size_t>(i)];
        const Face face = face_of(mesh, f);
        sum += double_layer_integral(face, x, wave.wavenumber()) * surface.row(f);
        re[n] = 0.0;
        im[n] = 0.0;
        winding += solid_angle(face, x) / (4.0 * std::numbers::pi);
        winding += pair_loops().static_sum(at, faces.sources(first + begin), weights.data() + first + begin,
                                           near[static_cast<std::size_t>(i)] - begin);
        begin = near[static_cast<std::size_t>(i)] + 1;
      }
      winding +=
          pair_loops().static_sum(at, faces.sources(first + begin), weights.data() + first + begin, count - begin);
      for (Eigen::Index s = 0; s < surface.cols(); ++s) {
        const PairProducts<double> p = pair_loops_of<double>().products(
            re.data(), im.data(), weighted_re.col(s).data() + first, weighted_im.col(s).data() + first, count);
        sum(s) += Complex(p.rr - p.ii, p.ri + p.ir);
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

}  // namespace touchfield
