#include "sim/mesh/query/surface_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

constexpr std::size_t kEnoughFaces = 9;

/// The quadratic's terms, those of lower degree first.
using Terms = Eigen::Matrix<double, 6, 1>;

Terms terms_at(double u, double v) { return Terms(1.0, u, v, u * u, u * v, v * v); }

}  // namespace

SurfaceFit::SurfaceFit(const TriangleMesh& mesh)
    : mesh_(mesh), tree_(mesh), round_(mesh.triangles(), mesh.vertex_count()) {}

void SurfaceFit::gather(Index face, std::vector<Index>& faces) const {
  const Vector3 normal = mesh_.normals().col(face);
  faces.assign(1, face);
  add_ring(mesh_, round_, normal, faces);
  if (faces.size() < kEnoughFaces) {
    add_ring(mesh_, round_, normal, faces);
  }
}

/// Weights of the stencil's faces for the value at x, which lies in the plane with this normal. The weighted normal
/// equations N c = sum w t(u_i) f_i and the value t(0).c = c_0 give the weights w t(u_i).y with N y = t(0).
void SurfaceFit::weigh(const Vector3& x, const Vector3& normal, Stencil& stencil) const {
  constexpr double kDetermined = 1e-6;  // least pivot over the largest; 1e-2 on rings of good triangles
  const Vector3 u = normal.unitOrthogonal();
  const Vector3 v = normal.cross(u);
  double size = 0;
  for (const Index f : stencil.faces) {
    size = std::max(size, (mesh_.centroids().col(f) - x).norm());
  }
  const auto place = [&](Index f) {
    const Vector3 from = (mesh_.centroids().col(f) - x) / size;
    return Eigen::Vector2d(from.dot(u), from.dot(v));
  };
  // A Gaussian that falls to 1/e^2 at the rim: near faces lead, far ones still determine the curvature.
  const auto importance = [](const Eigen::Vector2d& at) { return std::exp(-2.0 * at.squaredNorm()); };

  Eigen::Matrix<double, 6, 6> normal_matrix = Eigen::Matrix<double, 6, 6>::Zero();
  for (const Index f : stencil.faces) {
    const Eigen::Vector2d at = place(f);
    const Terms terms = terms_at(at.x(), at.y());
    normal_matrix += importance(at) * terms * terms.transpose();
  }
  Terms solved = Terms::Zero();
  for (const Index degree : {2, 1, 0}) {
    const Index terms = (degree + 1) * (degree + 2) / 2;
    using UpTo6 = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
    Eigen::ColPivHouseholderQR<UpTo6> qr;
    qr.setThreshold(kDetermined);
    qr.compute(UpTo6(normal_matrix.topLeftCorner(terms, terms)));
    if (degree == 0 || qr.rank() == terms) {
      solved.head(terms) = qr.solve(Terms::Unit(0).head(terms));
      break;
    }
  }
  stencil.weights.clear();
  for (const Index f : stencil.faces) {
    const Eigen::Vector2d at = place(f);
    stencil.weights.push_back(importance(at) * terms_at(at.x(), at.y()).dot(solved));
  }
}

Eigen::MatrixXcd SurfaceFit::at(const Points& points, const Points& normals, const Eigen::MatrixXcd& values) const {
  require(normals.cols() == points.cols() && values.rows() == mesh_.face_count(),
          "surface fit: {} points have {} normals, {} faces have {} values", points.cols(), normals.cols(),
          mesh_.face_count(), values.rows());
  Eigen::MatrixXcd result(points.cols(), values.cols());
  Index lost = points.cols();
#pragma omp parallel reduction(min : lost)
  {
    Stencil stencil;
#pragma omp for schedule(dynamic, 64)
    for (Index j = 0; j < points.cols(); ++j) {
      const SkinPoint skin = tree_.nearest_facing(points.col(j), normals.col(j), kSameSide);
      if (skin.face < 0) {
        lost = std::min(lost, j);
        continue;
      }
      gather(skin.face, stencil.faces);
      weigh(skin.at, mesh_.normals().col(skin.face), stencil);
      for (Index s = 0; s < values.cols(); ++s) {
        Complex sum = 0;
        for (std::size_t i = 0; i < stencil.faces.size(); ++i) {
          sum += stencil.weights[i] * values(stencil.faces[i], s);
        }
        result(j, s) = sum;
      }
    }
  }
  if (lost < points.cols()) {
    throw InputError(fmt::format("surface fit: no face looks within 60 degrees of the normal of point {} at {}", lost,
                                 place_text(points.col(lost), 2)));
  }
  return result;
}

Eigen::VectorXd signed_distances(const TriangleMesh& from, const TriangleMesh& to) {
  const FaceTree tree(to);
  Eigen::VectorXd distances(from.face_count());
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index f = 0; f < from.face_count(); ++f) {
    const Vector3 x = from.centroids().col(f);
    const Vector3 normal = from.normals().col(f);
    const SkinPoint nearest = tree.nearest_facing(x, normal, 0.0);
    distances(f) = nearest.face < 0 ? std::numeric_limits<double>::quiet_NaN()
                                    : std::copysign(nearest.distance, normal.dot(nearest.at - x));
  }
  return distances;
}

SkinDistance skin_distance(const TriangleMesh& mesh, const Eigen::VectorXd& distances, const std::vector<bool>& keep) {
  require(distances.size() == mesh.face_count() &&
              (keep.empty() || keep.size() == static_cast<std::size_t>(mesh.face_count())),
          "skin distance: {} distances and {} choices of {} faces", distances.size(), keep.size(), mesh.face_count());
  SkinDistance result;
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (!std::isnan(distances(f)) && (keep.empty() || keep[static_cast<std::size_t>(f)])) {
      faces.push_back(f);
      const double area = mesh.areas()(f);
      result.area += area;
      result.mean += area * distances(f);
      result.rms += area * distances(f) * distances(f);
    }
  }
  if (faces.empty()) {
    return result;
  }
  result.mean /= result.area;
  result.rms = std::sqrt(result.rms / result.area);
  std::ranges::sort(faces, {}, [&](Eigen::Index f) { return std::abs(distances(f)); });
  result.most = std::abs(distances(faces.back()));
  double nearer = 0;
  for (const Eigen::Index f : faces) {
    nearer += mesh.areas()(f);
    result.p95 = std::abs(distances(f));
    if (nearer >= 0.95 * result.area) {
      break;
    }
  }
  return result;
}

}  // namespace touchfield
