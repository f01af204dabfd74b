#include "sim/field/evaluate.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/element_integrals.h"
#include "sim/bem/face_arrays.h"
#include "sim/bem/pair_loops.h"
#include "sim/bem/quadrature.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kBlock = 256;  // faces a pass: what a pass reads and writes stays in the first cache

/// A surface as the sums over its faces need it, in half wavelengths.
struct FieldFaces {
  FieldFaces(const TriangleMesh& surface, const Wave& wave)
      : mesh(surface), wavenumber(wave.wavenumber()), reach_squared(kFarDistance * kFarDistance * arrays.area) {}

  PairPoint<double> point(const Vector3& x) const { return {scale * x.x(), scale * x.y(), scale * x.z(), 0, 0, 0}; }

  const TriangleMesh& mesh;
  Complex wavenumber;
  double scale = half_wavelengths(wavenumber);
  FaceArrays<double> arrays{mesh, scale};
  Eigen::VectorXd reach_squared;
};

/// Adds what the near ones among `count` faces from `first` on make at x, and their winding. Their numbers from `first` on,
/// ascending, go to `near`; returns how many they are.
int add_near(const FieldFaces& faces, const Vector3& x, const Eigen::MatrixXcd& surface, Eigen::Index first, int count,
             Eigen::Ref<Eigen::RowVectorXcd, 0, Eigen::InnerStride<>> sum, double& winding, int* near) {
  const int found = pair_loops().near_sources(faces.point(x), faces.arrays.sources(first),
                                              faces.reach_squared.data() + first, count, near);
  for (int i = 0; i < found; ++i) {
    const Face face = face_of(faces.mesh, first + near[i]);
    sum += double_layer_integral(face, x, faces.wavenumber) * surface.row(first + near[i]);
    winding += solid_angle(face, x) / (4.0 * std::numbers::pi);
  }
  return found;
}

/// Share of the full solid angle at a point; -1 inside, 0 outside.
bool is_inside(double winding) { return winding < -0.5; }

FieldValues silent_inside(FieldValues values) {
  for (Eigen::Index j = 0; j < values.pressure.rows(); ++j) {
    if (values.inside[static_cast<std::size_t>(j)] != 0) {
      values.pressure.row(j).setZero();
    }
  }
  return values;
}

}  // namespace

FieldValues boundary_integral(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                              const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  FieldValues values{incident_pressure(array, wave, points, drive),
                     std::vector<unsigned char>(static_cast<std::size_t>(points.cols()), 0)};
  const FieldFaces faces(mesh, wave);
  const auto constants = pair_constants<double>(wave.wavenumber(), 0.0);
  const Eigen::VectorXd weights = faces.arrays.area / (4.0 * std::numbers::pi);
  const Eigen::MatrixXd weighted_re = weights.asDiagonal() * surface.real();
  const Eigen::MatrixXd weighted_im = weights.asDiagonal() * surface.imag();
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    const Vector3 x = points.col(j);
    const PairPoint<double> at = faces.point(x);
    std::array<double, kBlock> re{};
    std::array<double, kBlock> im{};
    std::array<int, kBlock> near{};
    double winding = 0.0;
    auto sum = values.pressure.row(j);
    for (Eigen::Index first = 0; first < mesh.face_count(); first += kBlock) {
      const auto count = static_cast<int>(std::min(kBlock, mesh.face_count() - first));
      const PairSources<double> sources = faces.arrays.sources(first);
      pair_loops_of<double>().values(Layer::kDouble, constants, at, sources, count, re.data(), im.data());
      const int found = add_near(faces, x, surface, first, count, sum, winding, near.data());
      int begin = 0;  // of the far faces after the last near one
      for (int i = 0; i < found; ++i) {
        const int n = near[static_cast<std::size_t>(i)];
        re[static_cast<std::size_t>(n)] = 0.0;
        im[static_cast<std::size_t>(n)] = 0.0;
        winding +=
            pair_loops().static_sum(at, faces.arrays.sources(first + begin), weights.data() + first + begin, n - begin);
        begin = n + 1;
      }
      winding += pair_loops().static_sum(at, faces.arrays.sources(first + begin), weights.data() + first + begin,
                                         count - begin);
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
  return silent_inside(boundary_integral(mesh, array, wave, points, surface, drive));
}

FieldValues with_near_faces(const TriangleMesh& mesh, const Wave& wave, const Points& points,
                            const Eigen::MatrixXcd& surface, Eigen::MatrixXcd far, const Eigen::VectorXd& winding,
                            const std::vector<int>& near) {
  FieldValues values{std::move(far), std::vector<unsigned char>(near.size())};
  const FieldFaces faces(mesh, wave);
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    std::array<int, kBlock> found{};
    double all = winding(j);
    const bool has_near = near[static_cast<std::size_t>(j)] > 0;
    for (Eigen::Index first = 0; has_near && first < mesh.face_count(); first += kBlock) {
      const auto count = static_cast<int>(std::min(kBlock, mesh.face_count() - first));
      add_near(faces, points.col(j), surface, first, count, values.pressure.row(j), all, found.data());
    }
    values.inside[static_cast<std::size_t>(j)] = is_inside(all) ? 1 : 0;
  }
  return silent_inside(std::move(values));
}

}  // namespace touchfield
