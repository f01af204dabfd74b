#include "sim/mesh/query/surface_fit.h"

#include <cmath>
#include <complex>

#include <Eigen/Geometry>

#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"

namespace touchfield::surface_fit_test {

constexpr double kRadius = 0.03;

/// exp(i k.x) where the ray through x meets the sphere: a function on the surface, whatever mesh stands for it.
Eigen::VectorXcd wave_on_sphere(const Points& points) {
  const Vector3 k(60.0, -100.0, 80.0);  // [rad/m], |k| a = 4.2
  Eigen::VectorXcd wave(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    wave(i) = std::polar(1.0, kRadius * k.dot(points.col(i).normalized()));
  }
  return wave;
}

double error_on_sphere(int subdivisions) {
  const TriangleMesh fine = icosphere(kRadius, subdivisions);
  const TriangleMesh coarse = icosphere(kRadius, (2 * subdivisions + 2) / 3);
  // Turned, so that the meshes share no symmetry.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  const TriangleMesh other = transformed(coarse, turn, Vector3::Zero());
  const Eigen::VectorXcd fitted =
      SurfaceFit(fine).at(other.centroids(), other.normals(), wave_on_sphere(fine.centroids()));
  return (fitted - wave_on_sphere(other.centroids())).norm() / std::sqrt(static_cast<double>(other.face_count()));
}

// A complete quadratic: halving the edge divides the error by eight; the even terms that follow may help, to sixteen.
TEST(SurfaceFit, ConvergesWithThirdOrderOnTheSphere) {
  const double coarse = error_on_sphere(12);
  const double fine = error_on_sphere(24);
  const double finest = error_on_sphere(48);
  EXPECT_THAT(std::log2(coarse / fine), AllOf(Ge(2.6), Le(4.2)));
  EXPECT_THAT(std::log2(fine / finest), AllOf(Ge(2.6), Le(4.2)));
  EXPECT_LT(finest, 1e-4);
}

// The points include some at rims and corners, whose stencils are one-sided.
TEST(SurfaceFit, IsExactForQuadraticsOnAFlatSide) {
  const TriangleMesh mesh = box({0.04, 0.03, 0.02}, 2e-3).mesh;
  const auto linear = [](const Vector3& x) { return Complex(1 + 30 * x.x() - 20 * x.y(), 10 * x.y() + 5 * x.z()); };
  const auto quadratic = [](const Vector3& x) {
    return Complex(1 + 900 * x.x() * x.x() - 400 * x.x() * x.y(), 700 * x.y() * x.y());
  };
  Eigen::MatrixXcd values(mesh.face_count(), 2);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    values.row(f) << linear(mesh.centroids().col(f)), quadratic(mesh.centroids().col(f));
  }
  const SurfaceFit fit(mesh);
  Points points(3, 25);
  for (int i = 0; i < 25; ++i) {
    points.col(i) << 0.02 * (i % 5 - 2) / 2.0, 0.015 * (i / 5 - 2) / 2.0, 0.01;
  }
  const Points normals = Vector3(0, 0, 1).replicate(1, 25);
  const Eigen::MatrixXcd fitted = fit.at(points, normals, values);
  ASSERT_EQ(fitted.cols(), 2);
  for (int i = 0; i < 25; ++i) {
    EXPECT_LT(std::abs(fitted(i, 0) - linear(points.col(i))), 1e-10) << i;
    EXPECT_LT(std::abs(fitted(i, 1) - quadratic(points.col(i))), 1e-10) << i;
  }
}

// A plate half an edge thick: nearer to the other side than to the next face.
TEST(SurfaceFit, DoesNotMixTheSidesOfAThinPlate) {
  const TriangleMesh plate = box({0.04, 0.04, 1e-3}, 2e-3).mesh;
  const Eigen::VectorXcd values =
      plate.normals().row(2).transpose().cast<Complex>();  // 1 above, -1 below, 0 on the rim
  Points points(3, 3);
  points << 0.003, 0.0195, -0.0198,  // the second and third are half a millimetre from the rim
      0.001, 0.002, 0.0196,          //
      0.2e-3, 0.5e-3, 0.5e-3;        // and the first below the middle of the upper half
  const SurfaceFit fit(plate);
  const Eigen::VectorXcd above = fit.at(points, Vector3(0, 0, 1).replicate(1, 3), values);
  const Eigen::VectorXcd below = fit.at(points, Vector3(0, 0, -1).replicate(1, 3), values);
  EXPECT_LT((above.array() - 1.0).abs().maxCoeff(), 1e-12);
  EXPECT_LT((below.array() + 1.0).abs().maxCoeff(), 1e-12);
}

// Two faces a side: too few for a quadratic, and for a linear fit; the mean of a constant is that constant.
TEST(SurfaceFit, FallsBackOnCoarseMeshes) {
  const TriangleMesh cube = box({0.02, 0.02, 0.02}, 0.02).mesh;
  const Eigen::VectorXcd ones = Eigen::VectorXcd::Ones(cube.face_count());
  const Eigen::VectorXcd fitted = SurfaceFit(cube).at(cube.centroids(), cube.normals(), ones);
  EXPECT_LT((fitted - ones).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(SurfaceFit, RefusesWhatDoesNotFit) {
  const TriangleMesh mesh = icosphere(kRadius, 3);
  const Eigen::VectorXcd values = Eigen::VectorXcd::Ones(mesh.face_count());
  const TriangleMesh sheet(mesh.vertices(), mesh.triangles().col(0));
  EXPECT_THAT([&] { SurfaceFit(sheet).at(mesh.centroids(), -mesh.normals().col(0).replicate(1, 180), values.head(1)); },
              ThrowsMessage<InputError>(HasSubstr("within 60 degrees of the normal of point 0")));
}

}  // namespace touchfield::surface_fit_test
