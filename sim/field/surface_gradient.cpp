#include "sim/field/surface_gradient.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

constexpr Index kMost = 40;  // two rings of a regular mesh are 36
// Mean square error of pressures, of their mean square: as boundary elements have it, and so that weights stay small.
constexpr double kNoise = 1e-4;
constexpr double kNoiseFrom = 3.0;   // reach times k below which it falls
constexpr double kSeriesUpTo = 0.5;  // where the closed forms would cancel

using UpToMost = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
using Slopes = Eigen::Matrix<double, Eigen::Dynamic, 2, 0, kMost, 2>;

/// 1 - sin(x)/x.
double semivariance(double x) {
  if (x < kSeriesUpTo) {
    const double y = x * x;
    return y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0))));
  }
  return 1.0 - std::sin(x) / x;
}

/// Its derivative over x: (sin(x) - x cos(x)) / x^3.
double semivariance_slope(double x) {
  if (x < kSeriesUpTo) {
    const double y = x * x;
    return (1.0 - y / 10.0 * (1.0 - y / 28.0 * (1.0 - y / 54.0 * (1.0 - y / 88.0)))) / 3.0;
  }
  return (std::sin(x) - x * std::cos(x)) / (x * x * x);
}

/// The faces of two rings round a face but itself, the nearest first if they are too many.
void gather(const TriangleMesh& mesh, const FacesRound& round, Index face, std::vector<Index>& faces) {
  const Vector3 normal = mesh.normals().col(face);
  faces.assign(1, face);
  add_ring(mesh, round, normal, faces);
  if (faces.size() <= kMost) {
    add_ring(mesh, round, normal, faces);
  }
  faces.erase(faces.begin());
  if (faces.size() > kMost) {
    const auto distance = [&](Index f) { return (mesh.centroids().col(f) - mesh.centroids().col(face)).squaredNorm(); };
    std::nth_element(faces.begin(), faces.begin() + kMost, faces.end(),
                     [&](Index a, Index b) { return distance(a) < distance(b); });
    faces.resize(kMost);
  }
}

/// Weights of pressures at `places` (3 x n, in units of 1/k, from the face's centroid) for the slopes along u and v.
Slopes weights(const Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMost>& places, const Vector3& u,
               const Vector3& v) {
  const Index n = places.cols();
  const double reach = places.colwise().norm().maxCoeff();
  const double noise = kNoise * std::min(1.0, std::pow(reach / kNoiseFrom, 4));
  UpToMost covariance(n, n);
  Slopes slopes(n, 2);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1> own(n);
  for (Index i = 0; i < n; ++i) {
    const double r = places.col(i).norm();
    own(i) = semivariance(r);
    slopes.row(i) = semivariance_slope(r) * Eigen::RowVector2d(places.col(i).dot(u), places.col(i).dot(v));
    for (Index j = 0; j <= i; ++j) {
      covariance(i, j) = own(i) + own(j) - semivariance((places.col(i) - places.col(j)).norm()) + noise;
    }
    covariance(i, i) += noise;
  }
  return Eigen::LDLT<UpToMost, Eigen::Lower>(covariance).solve(slopes);
}

/// Two directions in the plane of a face.
std::pair<Vector3, Vector3> directions(const TriangleMesh& mesh, Index face) {
  const Vector3 normal = mesh.normals().col(face);
  const Vector3 u = normal.unitOrthogonal();
  return {u, normal.cross(u)};
}

}  // namespace

Eigen::SparseMatrix<float, Eigen::RowMajor> surface_slopes(const TriangleMesh& mesh, double k,
                                                           const std::vector<Index>& faces) {
  const FacesRound round(mesh.triangles(), mesh.vertex_count());
  const auto count = static_cast<Index>(faces.size());
  std::vector<std::vector<Index>> neighbours(faces.size());
  std::vector<Slopes> slopes(faces.size());
#pragma omp parallel
  {
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMost> places;
#pragma omp for schedule(dynamic, 64)
    for (Index i = 0; i < count; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Index f = faces[at];
      std::vector<Index>& own = neighbours[at];
      gather(mesh, round, f, own);
      std::ranges::sort(own);
      places.resize(3, static_cast<Index>(own.size()));
      for (Index j = 0; j < places.cols(); ++j) {
        places.col(j) = k * (mesh.centroids().col(own[static_cast<std::size_t>(j)]) - mesh.centroids().col(f));
      }
      if (!own.empty()) {
        const auto [u, v] = directions(mesh, f);
        slopes[at] = k * weights(places, u, v);
      }
    }
  }
  Eigen::SparseMatrix<float, Eigen::RowMajor> matrix(2 * count, mesh.face_count());
  matrix.reserve(Eigen::VectorXi::Constant(2 * count, static_cast<int>(kMost) + 1));
  for (Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (Index along = 0; along < 2 && !neighbours[at].empty(); ++along) {
      for (std::size_t j = 0; j < neighbours[at].size(); ++j) {
        matrix.insert(2 * i + along, neighbours[at][j]) = static_cast<float>(slopes[at](static_cast<Index>(j), along));
      }
      matrix.insert(2 * i + along, faces[at]) = static_cast<float>(-slopes[at].col(along).sum());
    }
  }
  matrix.makeCompressed();
  return matrix;
}

SurfaceGradient::SurfaceGradient(const TriangleMesh& mesh, double k)
    : u_(3, mesh.face_count()), v_(3, mesh.face_count()) {
  std::vector<Index> all(static_cast<std::size_t>(mesh.face_count()));
  std::iota(all.begin(), all.end(), Index{0});
  slopes_ = surface_slopes(mesh, k, all);
  for (Index f = 0; f < mesh.face_count(); ++f) {
    const auto [u, v] = directions(mesh, f);
    u_.col(f) = u;
    v_.col(f) = v;
  }
}

Eigen::Matrix3Xcd SurfaceGradient::of(const Eigen::VectorXcd& pressure) const {
  Eigen::Matrix3Xcd gradient(3, u_.cols());
#pragma omp parallel for schedule(static)
  for (Index f = 0; f < gradient.cols(); ++f) {
    Complex along[2] = {};
    for (int i = 0; i < 2; ++i) {
      for (decltype(slopes_)::InnerIterator entry(slopes_, 2 * f + i); entry; ++entry) {
        along[i] += static_cast<double>(entry.value()) * (pressure(entry.col()) - pressure(f));
      }
    }
    gradient.col(f) = along[0] * u_.col(f) + along[1] * v_.col(f);
  }
  return gradient;
}

}  // namespace touchfield
