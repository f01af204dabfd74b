#include "sim/field/surface_gradient.h"

#include <algorithm>
#include <cmath>
#include <vector>

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

}  // namespace

SurfaceGradient::SurfaceGradient(const TriangleMesh& mesh, double k)
    : u_(3, mesh.face_count()),
      v_(3, mesh.face_count()),
      count_(mesh.face_count()),
      neighbours_(kMost, mesh.face_count()),
      along_u_(kMost, mesh.face_count()),
      along_v_(kMost, mesh.face_count()) {
  const FacesRound round(mesh.triangles(), mesh.vertex_count());
#pragma omp parallel
  {
    std::vector<Index> faces;
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMost> places;
#pragma omp for schedule(dynamic, 64)
    for (Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 u = Vector3(mesh.normals().col(f)).unitOrthogonal();
      const Vector3 v = Vector3(mesh.normals().col(f)).cross(u);
      gather(mesh, round, f, faces);
      const auto n = static_cast<Index>(faces.size());
      u_.col(f) = u;
      v_.col(f) = v;
      count_(f) = static_cast<int>(n);
      if (n == 0) {
        continue;
      }
      places.resize(3, n);
      for (Index i = 0; i < n; ++i) {
        const Index neighbour = faces[static_cast<std::size_t>(i)];
        neighbours_(i, f) = static_cast<int>(neighbour);
        places.col(i) = k * (mesh.centroids().col(neighbour) - mesh.centroids().col(f));
      }
      const Slopes solved = weights(places, u, v);
      along_u_.col(f).head(n) = (k * solved.col(0)).cast<float>();
      along_v_.col(f).head(n) = (k * solved.col(1)).cast<float>();
    }
  }
}

Eigen::Matrix3Xcd SurfaceGradient::of(const Eigen::VectorXcd& pressure) const {
  Eigen::Matrix3Xcd gradient(3, count_.size());
#pragma omp parallel for schedule(static)
  for (Index f = 0; f < count_.size(); ++f) {
    Complex along_u = 0;
    Complex along_v = 0;
    for (Index i = 0; i < count_(f); ++i) {
      const Complex difference = pressure(neighbours_(i, f)) - pressure(f);
      along_u += static_cast<double>(along_u_(i, f)) * difference;
      along_v += static_cast<double>(along_v_(i, f)) * difference;
    }
    gradient.col(f) = along_u * u_.col(f) + along_v * v_.col(f);
  }
  return gradient;
}

}  // namespace touchfield
