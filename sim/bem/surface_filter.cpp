#include "sim/bem/surface_filter.h"

#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "sim/bem/filter_formulas.h"
#include "sim/mesh/topology.h"
#include "solvers/linear/sparse_product.h"

namespace touchfield {

namespace {

/// Distance of a face's centroid from the line of its edge from corner c on.
double height(const TriangleMesh& mesh, Eigen::Index face, int c) {
  const Vector3 from = mesh.corner(face, c);
  const Vector3 along = (mesh.corner(face, (c + 1) % 3) - from).normalized();
  return (mesh.centroids().col(face) - from).cross(along).norm();
}

}  // namespace

SurfaceFilter::SurfaceFilter(const TriangleMesh& mesh, const Complex& wavenumber, double coupling)
    : areas_(mesh.areas()), shifted_(mesh.face_count(), mesh.face_count()) {
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(mesh.face_count());
  for_each_edge(sorted_sides(mesh.triangles()), [&](std::span<const Side> sides) {
    if (sides.size() != 2) {  // nothing flows where a surface ends or branches
      return;
    }
    const Side& one = sides[0];
    const Side& other = sides[1];
    const double length = (mesh.corner(one.face, (one.corner + 1) % 3) - mesh.corner(one.face, one.corner)).norm();
    const double weight = length / (height(mesh, one.face, one.corner) + height(mesh, other.face, other.corner));
    entries.emplace_back(one.face, other.face, -weight / areas_(one.face));
    entries.emplace_back(other.face, one.face, -weight / areas_(other.face));
    diagonal(one.face) += weight / areas_(one.face);
    diagonal(other.face) += weight / areas_(other.face);
  });
  const double largest = 2.0 * diagonal.maxCoeff();
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    entries.emplace_back(f, f, diagonal(f) - 0.5 * largest);
  }
  shifted_.setFromTriplets(entries.begin(), entries.end());
  shifted_ *= 2.0 / largest;
  const std::vector<Complex> coefficients = filter_coefficients(wavenumber, coupling, largest);
  coefficients_ = Eigen::VectorXcd::Map(coefficients.data(), static_cast<Eigen::Index>(coefficients.size()));
}

Eigen::MatrixXcd SurfaceFilter::apply(const Eigen::MatrixXcd& x) const {
  Eigen::MatrixXcd before = x;
  Eigen::MatrixXcd now(x.rows(), x.cols());
  Eigen::MatrixXcd next(x.rows(), x.cols());
  sparse_product(shifted_, before, now);
  Eigen::MatrixXcd y = coefficients_(0) * before + coefficients_(1) * now;
  for (int j = 2; j <= degree(); ++j) {
    sparse_product(shifted_, now, next);
    next = 2.0 * next - before;
    y += coefficients_(j) * next;
    before.swap(now);
    now.swap(next);
  }
  return y;
}

Eigen::MatrixXcd SurfaceFilter::apply_transpose(const Eigen::MatrixXcd& x) const {
  return areas_.asDiagonal() * apply(areas_.cwiseInverse().asDiagonal() * x);
}

}  // namespace touchfield
