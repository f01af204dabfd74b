#include "sim/field/evaluate.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/grid_loops.h"
#include "sim/bem/grid_sum.h"
#include "sim/bem/layer_sum.h"
#include "sim/bem/pair_loops.h"
#include "sim/bem/quadrature.h"
#include "sim/core/require.h"
#include "sim/mesh/query/face_tree.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kBlock = 256;  // faces a pass: what a pass reads and writes stays in the first cache

using Row = Eigen::Ref<Eigen::RowVectorXcd, 0, Eigen::InnerStride<>>;

/// A surface as the sums over its faces need it, in half wavelengths.
struct FieldFaces {
  FieldFaces(const TriangleMesh& surface, const Wave& wave)
      : mesh(surface), wavenumber(wave.wavenumber()), reach_squared(kFarDistance * kFarDistance * arrays.area) {}

  PairPoint<double> point(const Vector3& x) const { return {scale * x.x(), scale * x.y(), scale * x.z(), 0, 0, 0}; }

  const TriangleMesh& mesh;
  Complex wavenumber;
  FaceQuadrature quadrature{wavenumber, 0.0, FaceRule()};  // to be copied
  double scale = half_wavelengths(wavenumber);
  FaceArrays<double> arrays{mesh, scale};
  Eigen::VectorXd reach_squared;
};

/// Adds the integrals over near faces, numbers from `first` on, to the sum at x.
void add_integrals(const FieldFaces& faces, const Vector3& x, const Eigen::MatrixXcd& surface, Eigen::Index first,
                   std::span<const int> near, FaceQuadrature& quadrature, Row sum) {
  quadrature.begin(x, Vector3::Zero());
  for (const int n : near) {
    quadrature.add(face_of(faces.mesh, first + n));
  }
  const std::vector<Complex>& integrals = quadrature.integrals(Layer::kDouble);
  for (std::size_t i = 0; i < near.size(); ++i) {
    sum += integrals[i] * surface.row(first + near[i]);
  }
}

/// Adds what the near ones among `count` faces from `first` on make at x, and their winding. Their numbers from `first`
/// on, ascending, go to `near`; returns how many they are.
int add_near(const FieldFaces& faces, const Vector3& x, const Eigen::MatrixXcd& surface, Eigen::Index first, int count,
             FaceQuadrature& quadrature, Row sum, double& winding, int* near) {
  const int found = pair_loops().near_sources(faces.point(x), faces.arrays.sources(first),
                                              faces.reach_squared.data() + first, count, near);
  add_integrals(faces, x, surface, first, {near, static_cast<std::size_t>(found)}, quadrature, sum);
  for (int i = 0; i < found; ++i) {
    winding += solid_angle(face_of(faces.mesh, first + near[i]), x) / (4.0 * std::numbers::pi);
  }
  return found;
}

/// Share of the full solid angle at a point; -1 inside, 0 outside.
bool is_inside(double winding) { return winding < -0.5; }

/// Pair by pair.
void add_directly(const FieldFaces& faces, const Points& points, const Eigen::MatrixXcd& surface, FieldValues& values) {
  const auto constants = pair_constants<double>(faces.wavenumber, 0.0);
  const Eigen::VectorXd weights = faces.arrays.area / (4.0 * std::numbers::pi);
  const Eigen::MatrixXd weighted_re = weights.asDiagonal() * surface.real();
  const Eigen::MatrixXd weighted_im = weights.asDiagonal() * surface.imag();
  FaceQuadrature quadrature = faces.quadrature;
#pragma omp parallel for schedule(dynamic, 64) firstprivate(quadrature)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    const Vector3 x = points.col(j);
    const PairPoint<double> at = faces.point(x);
    std::array<double, kBlock> re{};
    std::array<double, kBlock> im{};
    std::array<int, kBlock> near{};
    double winding = 0.0;
    auto sum = values.pressure.row(j);
    for (Eigen::Index first = 0; first < faces.arrays.size(); first += kBlock) {
      const auto count = static_cast<int>(std::min(kBlock, faces.arrays.size() - first));
      const PairSources<double> sources = faces.arrays.sources(first);
      pair_loops_of<double>().values(Layer::kDouble, constants, at, sources, count, re.data(), im.data());
      const int found = add_near(faces, x, surface, first, count, quadrature, sum, winding, near.data());
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
}

/// How far a corner of a face is from its centroid at most.
double largest_radius(const TriangleMesh& mesh) {
  double squared = 0.0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      squared = std::max(squared, (mesh.corner(f, c) - mesh.centroids().col(f)).squaredNorm());
    }
  }
  return std::sqrt(squared);
}

/// The smooth part of the kernel by a grid, the local part and the integrals over near faces by a tree.
void add_by_grid(const FieldFaces& faces, const GridSpec& spec, const Points& points, const Eigen::MatrixXcd& surface,
                 FieldValues& values) {
  constexpr double kCoincident = 1e-10;  // squared, below which neither part of the kernel adds anything
  const TriangleMesh& mesh = faces.mesh;
  values.pressure += smooth_double_layer(mesh, faces.wavenumber, spec, points, surface);
  const LocalKernel<double> local = KernelSplit(faces.wavenumber, spec.reach, spec.shape).local<double>(0.0);
  const FaceTree tree(mesh);
  const double radius = std::max(spec.reach, kFarDistance * std::sqrt(mesh.areas().maxCoeff()));
  const double largest = largest_radius(mesh);
  const double unit = 1.0 / (4.0 * std::numbers::pi * spec.reach * spec.reach);
  const auto columns = static_cast<int>(surface.cols());
#pragma omp parallel
  {
    FaceQuadrature quadrature = faces.quadrature;
    std::vector<Eigen::Index> found;
    std::vector<int> near;
    bool inside = false;
    Vector3 last = Vector3::Zero();  // a point that lies so,
    double clearance = 0.0;          // and how far about it no skin is
    Eigen::MatrixXd row;             // offsets in units of the reach, normals, values: one array a quantity
    Eigen::VectorXd sums(2 * columns);
#pragma omp for schedule(dynamic, 64)
    for (Eigen::Index j = 0; j < points.cols(); ++j) {
      const Vector3 x = points.col(j);
      if (!((x - last).norm() < clearance)) {
        inside = tree.winding_number(x) > 0.5;
      }
      values.inside[static_cast<std::size_t>(j)] = inside ? 1 : 0;
      last = x;
      clearance = radius - largest;
      tree.centroids_within(x, radius, found);
      const auto count = static_cast<int>(found.size());
      if (count == 0) {
        continue;
      }
      const PairPoint<double> at = faces.point(x);
      row.resize(count, 6 + 2 * columns);
      near.clear();
      for (int q = 0; q < count; ++q) {
        const Eigen::Index f = found[static_cast<std::size_t>(q)];
        const Vector3 offset(at.x - faces.arrays.x(f), at.y - faces.arrays.y(f), at.z - faces.arrays.z(f));
        const double squared = offset.squaredNorm();
        clearance = std::min(clearance, std::sqrt(squared) / faces.scale - largest);
        row.row(q).segment<3>(0) = -offset.transpose() / (faces.scale * spec.reach);
        row.row(q).segment<3>(3) = mesh.normals().col(f).transpose();
        const double weight = squared > kCoincident ? unit * mesh.areas()(f) : 0.0;
        row.row(q).segment(6, columns) = weight * surface.row(f).real();
        row.row(q).tail(columns) = weight * surface.row(f).imag();
        if (squared < faces.reach_squared(f)) {
          near.push_back(static_cast<int>(f));
          if (squared > kCoincident) {
            values.pressure.row(j) -=
                mesh.areas()(f) * double_layer_kernel(offset / faces.scale, mesh.normals().col(f), faces.wavenumber) *
                surface.row(f);
          }
        }
      }
      add_integrals(faces, x, surface, 0, near, quadrature, values.pressure.row(j));
      grid_loops_of<double>().local(Layer::kDouble, local, {0, 0, 0, 0, 0, 0},
                                    {row.col(0).data(), row.col(1).data(), row.col(2).data(), row.col(3).data(),
                                     row.col(4).data(), row.col(5).data()},
                                    count, row.col(6).data(), row.col(6 + columns).data(), count, columns, sums.data(),
                                    sums.data() + columns);
      for (int s = 0; s < columns; ++s) {
        values.pressure(j, s) += Complex(sums(s), sums(columns + s));
      }
    }
  }
}

/// Silence inside, and the skin's pressure on it.
FieldValues with_skin(const TriangleMesh& mesh, const Points& points, const Eigen::MatrixXcd& surface,
                      FieldValues values) {
  const FaceTree tree(mesh);
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    unsigned char& inside = values.inside[static_cast<std::size_t>(j)];
    if (const Eigen::Index face = tree.touched(points.col(j)).face; face >= 0) {
      inside = 0;
      values.pressure.row(j) = surface.row(face);
    } else if (inside != 0) {
      values.pressure.row(j).setZero();
    }
  }
  return values;
}

}  // namespace

FieldPoints field_points(const Points& points, Eigen::Index columns) {
  if (points.cols() == 0) {
    return {};
  }
  return {points.rowwise().minCoeff(), points.rowwise().maxCoeff(), static_cast<double>(points.cols()),
          static_cast<double>(columns)};
}

FieldSums choose_field_sums(const TriangleMesh& mesh, const Wave& wave, const FieldPoints& points, double faces) {
  // Seconds of one thread: of a pair, for each column of it; of a point and of a face beside the grid.
  constexpr double kPairSeconds = 16e-9;
  constexpr double kColumnSeconds = 0.3e-9;
  constexpr double kPointSeconds = 5e-6;
  constexpr double kFaceSeconds = 2e-6;
  constexpr double kOnce = 1.5;  // to make the grid, in products
  constexpr double kPays = 0.7;  // of the time pair by pair
  constexpr double kMostBytes = 4e9;
  FieldSums sums;
  faces = faces > 0 ? faces : static_cast<double>(mesh.face_count());
  sums.pairs = points.count * faces;
  if (sums.pairs == 0) {
    return sums;
  }
  GridBody body = grid_body(mesh);
  const Vector3 low = mesh.centroids().rowwise().minCoeff();
  body.extent = (low + body.extent).cwiseMax(points.high) - low.cwiseMin(points.low);
  body.faces = 0;  // what is within reach is the points' work
  const GridChoice grid = choose_grid(body, wave.wavenumber(), 0.0, kFieldTolerance);
  const double seconds = (points.columns + kOnce) * grid.seconds + kPointSeconds * points.count + kFaceSeconds * faces;
  const double pair_seconds = kPairSeconds + kColumnSeconds * points.columns;
  if (seconds < kPays * pair_seconds * sums.pairs && grid.memory < kMostBytes) {
    sums.grid = grid;
    sums.pairs = seconds / pair_seconds;
  }
  return sums;
}

FieldValues boundary_integral(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                              const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  const FieldSums sums = choose_field_sums(mesh, wave, field_points(points, surface.cols()));
  FieldValues values{incident_pressure(array, wave, points, drive, sums.grid.has_value()),
                     std::vector<unsigned char>(static_cast<std::size_t>(points.cols()), 0)};
  const FieldFaces faces(mesh, wave);
  if (sums.grid) {
    add_by_grid(faces, sums.grid->spec, points, surface, values);
  } else {
    add_directly(faces, points, surface, values);
  }
  return values;
}

FieldValues evaluate_field(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave,
                           const Points& points, const Eigen::MatrixXcd& surface, const Eigen::MatrixXcd& drive) {
  return with_skin(mesh, points, surface, boundary_integral(mesh, array, wave, points, surface, drive));
}

FieldValues with_near_faces(const TriangleMesh& mesh, const Wave& wave, const Points& points,
                            const Eigen::MatrixXcd& surface, Eigen::MatrixXcd far, const Eigen::VectorXd& winding,
                            const std::vector<int>& near) {
  FieldValues values{std::move(far), std::vector<unsigned char>(near.size())};
  const FieldFaces faces(mesh, wave);
  FaceQuadrature quadrature = faces.quadrature;
#pragma omp parallel for schedule(dynamic, 64) firstprivate(quadrature)
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    std::array<int, kBlock> found{};
    double all = winding(j);
    const bool has_near = near[static_cast<std::size_t>(j)] > 0;
    for (Eigen::Index first = 0; has_near && first < mesh.face_count(); first += kBlock) {
      const auto count = static_cast<int>(std::min(kBlock, mesh.face_count() - first));
      add_near(faces, points.col(j), surface, first, count, quadrature, values.pressure.row(j), all, found.data());
    }
    values.inside[static_cast<std::size_t>(j)] = is_inside(all) ? 1 : 0;
  }
  return with_skin(mesh, points, surface, std::move(values));
}

Points FieldGrid::points() const {
  Points all(3, size());
  Eigen::Index j = 0;
  for (int z = 0; z < count[2]; ++z) {
    for (int y = 0; y < count[1]; ++y) {
      for (int x = 0; x < count[0]; ++x) {
        all.col(j++) = origin + spacing.cwiseProduct(Vector3(x, y, z));
      }
    }
  }
  return all;
}

FieldGrid centred_grid(const std::string& name, const Vector3& centre, const Vector3& size, double spacing) {
  require(spacing > 0 && std::isfinite(spacing), "field {}: spacing = {} m must be > 0", name, spacing);
  FieldGrid grid{name, centre, Vector3::Constant(spacing), {1, 1, 1}};
  for (int axis = 0; axis < 3; ++axis) {
    require(size(axis) >= 0 && std::isfinite(size(axis)), "field {}: size = {} m must be >= 0", name, size(axis));
    // A size that is a multiple of the spacing but for rounding must not gain an interval.
    const int intervals = static_cast<int>(std::ceil(size(axis) / spacing * (1.0 - 1e-12)));
    if (intervals > 0) {
      grid.count[static_cast<std::size_t>(axis)] = intervals + 1;
      grid.spacing(axis) = size(axis) / intervals;
      grid.origin(axis) = centre(axis) - 0.5 * size(axis);
    }
  }
  return grid;
}

}  // namespace touchfield
