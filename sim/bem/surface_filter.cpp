#include "sim/bem/surface_filter.h"

#include <vector>

#include <Eigen/Geometry>

#include "sim/bem/filter_formulas.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

/// Distance of a face's centroid from the line of its edge from corner c on.
double height(const TriangleMesh& mesh, Eigen::Index face, int c) {
  const Vector3 from = mesh.corner(face, c);
  const Vector3 along = (mesh.corner(face, (c + 1) % 3) - from).normalized();
  return (mesh.centroids().col(face) - from).cross(along).norm();
}

/// y = a x for complex columns, rows shared among threads.
void multiply_rows(const Eigen::SparseMatrix<double, Eigen::RowMajor>& a, const Eigen::MatrixXcd& x,
                   Eigen::MatrixXcd& y) {
#pragma omp parallel for schedule(static)
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index s = 0; s < x.cols(); ++s) {
      Complex sum = 0;
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(a, i); it; ++it) {
        sum += it.value() * x(it.col(), s);
      }
      y(i, s) = sum;
    }
  }
}

}  // namespace

SurfaceFilter::SurfaceFilter(const TriangleMesh& mesh, const Complex& wavenumber, double coupling)
    : areas_(mesh.areas()), shifted_(mesh.face_count(), mesh.face_count()) {
  const EdgeTable table = edge_table(mesh.triangles());
  struct Meeting {
    Eigen::Index face = -1;
    int corner = 0;
    int faces = 0;
    Eigen::Index other = -1;
    int other_corner = 0;
  };
  std::vector<Meeting> edges(static_cast<std::size_t>(table.ends.cols()));
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      Meeting& edge = edges[static_cast<std::size_t>(table.of_face(c, f))];
      (edge.faces == 0 ? edge.face : edge.other) = f;
      (edge.faces == 0 ? edge.corner : edge.other_corner) = c;
      ++edge.faces;
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(mesh.face_count());
  for (const Meeting& edge : edges) {
    if (edge.faces != 2) {  // nothing flows where a surface ends or branches
      continue;
    }
    const double length = (mesh.corner(edge.face, (edge.corner + 1) % 3) - mesh.corner(edge.face, edge.corner)).norm();
    const double weight = length / (height(mesh, edge.face, edge.corner) + height(mesh, edge.other, edge.other_corner));
    entries.emplace_back(edge.face, edge.other, -weight / areas_(edge.face));
    entries.emplace_back(edge.other, edge.face, -weight / areas_(edge.other));
    diagonal(edge.face) += weight / areas_(edge.face);
    diagonal(edge.other) += weight / areas_(edge.other);
  }
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
  multiply_rows(shifted_, before, now);
  Eigen::MatrixXcd y = coefficients_(0) * before + coefficients_(1) * now;
  for (int j = 2; j <= degree(); ++j) {
    multiply_rows(shifted_, now, next);
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
