#include "sim/field/surface_gradient.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/core/rigid_motion.h"
#include "sim/field/metrics.h"
#include "tests/support/output_support.h"
#include "tests/support/sphere_support.h"
#include "tests/support/testing.h"

namespace touchfield::surface_gradient_test {

/// A flat sheet of nx x ny squares of side `edge`, cut in two, its points moved by up to a quarter of it.
TriangleMesh uneven_sheet(int nx, int ny, double edge) {
  const TriangleMesh flat = sheet(nx, ny, edge);
  Points moved = flat.vertices();
  std::srand(3);
  moved.topRows<2>() += 0.25 * edge * Eigen::Matrix2Xd::Random(2, moved.cols());
  return {moved, flat.triangles()};
}

/// exp(i s k x) at its place, s the share of the wavenumber that runs along the sheet.
double error_of_a_wave(const TriangleMesh& mesh, double share, double margin) {
  const double k = wave().k();
  const Vector3 direction = share * k * Vector3(std::cos(0.4), std::sin(0.4), 0.0);
  const Eigen::VectorXcd p = at_centroids(mesh, [&](const Vector3& x) { return std::polar(1.0, direction.dot(x)); });
  const Eigen::Matrix3Xcd gradient = SurfaceGradient(mesh, k).of(p);
  const Vector3 low = mesh.vertices().rowwise().minCoeff();
  const Vector3 far = mesh.vertices().rowwise().maxCoeff();
  double worst = 0.0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 x = mesh.centroids().col(f);
    if (std::min((x - low).head<2>().minCoeff(), (far - x).head<2>().minCoeff()) > margin) {
      worst = std::max(worst, (gradient.col(f) - Complex(0, 1) * p(f) * direction).norm() / k);
    }
  }
  return worst;
}

TEST(SurfaceGradient, OfWavesAlongAnUnevenSheet) {
  // Squares of 2.37 mm are 5.5 centroids a wavelength, as 3.2 edges of equilateral triangles.
  const TriangleMesh coarse = uneven_sheet(16, 14, 2.37e-3);
  for (const double share : {0.0, 0.3, 0.7, 0.95}) {
    EXPECT_LT(error_of_a_wave(coarse, share, 3 * 2.37e-3), 0.06) << share;
    EXPECT_LT(error_of_a_wave(coarse, share, 0.0), 0.25) << share;  // at the border all neighbours lie on one side
  }
  EXPECT_LT(error_of_a_wave(uneven_sheet(16, 14, 1.2e-3), 0.7, 3 * 1.2e-3), 0.01);
}

TEST(SurfaceGradient, OfWhatIsUniformIsNought) {
  const TriangleMesh mesh = icosphere(8e-3, 6);
  const Eigen::VectorXcd p = Eigen::VectorXcd::Constant(mesh.face_count(), Complex(3e4, -1e3));
  EXPECT_EQ(SurfaceGradient(mesh, wave().k()).of(p).cwiseAbs().maxCoeff(), 0.0);
}

TEST(SurfaceGradient, OfALinearPressureOnFaceSizesFarBelowTheWavelength) {
  // From edges of a hundredth of the wavelength on what samples are taken to err must fall with the mesh.
  for (const double edge : {80e-6, 8e-6, 0.8e-6, 8e-9}) {
    const TriangleMesh mesh = uneven_sheet(8, 8, edge);
    const Vector3 slope(2.0, -1.0, 0.0);
    const Eigen::VectorXcd p = at_centroids(mesh, [&](const Vector3& x) { return Complex(slope.dot(x)); });
    const Eigen::Matrix3Xcd gradient = SurfaceGradient(mesh, wave().k()).of(p);
    EXPECT_LT((gradient.colwise() - slope.cast<Complex>()).colwise().norm().maxCoeff(), 3e-3 * slope.norm()) << edge;
  }
}

TEST(SurfaceGradient, SidesOfASharpEdgeDoNotMix) {
  const TriangleMesh mesh = box({20e-3, 20e-3, 20e-3}, 2e-3).mesh;
  // Another pressure on each side.
  const Eigen::VectorXcd p = (mesh.normals().transpose() * Vector3(1, 2, 4)).cast<Complex>();
  EXPECT_EQ(SurfaceGradient(mesh, wave().k()).of(p).cwiseAbs().maxCoeff(), 0.0);
}

TEST(SurfaceGradient, WhereNeighboursAreFewOrInARow) {
  // One face: none. A row of faces: the slope along it is known, none is made up across.
  const TriangleMesh one(Points(1e-3 * Eigen::Matrix3d::Identity()), Triangles(Eigen::Vector3i(0, 1, 2)));
  EXPECT_EQ(SurfaceGradient(one, wave().k()).of(Eigen::VectorXcd::Ones(1)).norm(), 0.0);

  const TriangleMesh row = uneven_sheet(30, 1, 0.1e-3);
  const Eigen::VectorXcd p = at_centroids(row, [](const Vector3& x) { return Complex(x.x()); });
  const Eigen::Matrix3Xcd gradient = SurfaceGradient(row, wave().k()).of(p);
  EXPECT_LT((gradient.row(0).array() - 1.0).abs().maxCoeff(), 0.02);
  EXPECT_LT(gradient.row(1).cwiseAbs().maxCoeff(), 0.1);
}

TEST(RadiationForce, ErrorOfTheSlopesFallsWithTheMesh) {
  // ka 6.52 at 6.4 to 25.6 edges a wavelength: the face's plane is not the sphere's, which is of second order; what
  // pressures are taken to err costs some of it on the way.
  const double radius = radius_of(6.52);
  std::array<double, 3> errors{};
  const std::array<int, 3> meshes = {8, 16, 32};
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const TriangleMesh mesh = icosphere(radius, meshes[i]);
    const Eigen::VectorXd cosine = cosines(mesh);
    const Eigen::VectorXd angle = cosine.array().acos();
    const auto at = [&](double turn) {
      return rigid_sphere_plane_wave(wave(), radius, (angle.array() + turn).cos().matrix());
    };
    const Eigen::VectorXcd slope = (at(1e-5) - at(-1e-5)) / (2e-5 * radius);
    const Eigen::Matrix3Xcd found = SurfaceGradient(mesh, wave().k()).of(at(0.0));
    double difference = 0.0;
    double whole = 0.0;
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 away = (cosine(f) * mesh.centroids().col(f).normalized() - Vector3::UnitZ()).normalized();
      difference += mesh.areas()(f) * (found.col(f) - slope(f) * away).squaredNorm();
      whole += mesh.areas()(f) * std::norm(slope(f));
    }
    errors[i] = std::sqrt(difference / whole);
  }
  EXPECT_LT(errors[0], 0.009);
  for (std::size_t i = 1; i < meshes.size(); ++i) {
    EXPECT_THAT(std::log2(errors[i - 1] / errors[i]), AllOf(Ge(1.0), Le(2.3))) << meshes[i];
  }
}

/// Pressure on a rigid sphere in a plane wave of 1 Pa along +z, and its slope along the meridian over the radius. It is
/// summed here, apart from the program's series: derivatives of the spherical functions and of P_n by recurrences.
struct SeriesPoint {
  Complex pressure;
  Complex slope;  // dp/dtheta / a [Pa/m]
};

SeriesPoint series_at(double ka, double radius, double cosine) {
  const auto hankel = [&](unsigned n) { return Complex(std::sph_bessel(n, ka), std::sph_neumann(n, ka)); };
  const double sine = std::sqrt(1.0 - cosine * cosine);
  SeriesPoint sum = {};
  Complex power = 1.0;  // i^n
  double before = 0.0;  // P_(n-1)
  double here = 1.0;    // P_n
  for (unsigned n = 0; n < 45; ++n) {
    const double degree = n;
    const Complex h_slope = (n == 0 ? Complex(0) : hankel(n - 1)) - (degree + 1.0) / ka * hankel(n);
    const Complex factor = (2.0 * degree + 1.0) * power * Complex(0, 1) / (ka * ka * (n == 0 ? -hankel(1) : h_slope));
    sum.pressure += factor * here;
    // dP_n/dtheta = n (cos P_n - P_(n-1)) / sin
    sum.slope += factor * degree * (cosine * here - before) / (sine * radius);
    const double next = ((2.0 * degree + 1.0) * cosine * here - degree * before) / (degree + 1.0);
    before = here;
    here = next;
    power *= Complex(0, 1);
  }
  return sum;
}

/// P at the direction of every face from the sphere's centre: the potential less the kinetic energy of the flow along
/// the skin, at velocity slope / (i omega rho).
Eigen::VectorXd series_radiation(const TriangleMesh& mesh, double ka, double radius) {
  const Medium air = wave().medium();
  Eigen::VectorXd radiation(mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const SeriesPoint at = series_at(ka, radius, cosines(mesh)(f));
    const Complex velocity = at.slope / (Complex(0, 1) * wave().omega() * air.density);
    radiation(f) = std::norm(at.pressure) / (4.0 * air.density * std::pow(air.sound_speed, 2)) -
                   air.density * std::norm(velocity) / 4.0;
  }
  return radiation;
}

TEST(RadiationPressure, OfEachFaceOfASphereIsThatOfTheSeries) {
  // 6.0 edges per wavelength.
  for (const auto& [ka, subdivisions] : {std::pair{6.0, 7}, {13.0, 15}}) {
    SCOPED_TRACE(ka);
    const double radius = radius_of(ka);
    const TriangleMesh mesh = icosphere(radius, subdivisions);
    const Eigen::VectorXcd p =
        solve_sphere(Scheme::kBurtonMillerPolished, {.ka = ka, .subdivisions = subdivisions}).pressure;
    const Eigen::VectorXd found = radiation_pressure(SurfaceGradient(mesh, wave().k()), wave(), p);
    const Eigen::VectorXd exact = series_radiation(mesh, ka, radius);
    const double error = std::sqrt(mesh.areas().dot((found - exact).cwiseAbs2()) / mesh.areas().dot(exact.cwiseAbs2()));
    const double force = -mesh.areas().cwiseProduct(found).dot(mesh.normals().row(2));
    const double force_error = force / rigid_sphere_force(wave(), radius, 1.0) - 1.0;
    std::printf("ka %.0f, %.2f edges per wavelength: P %.2f %%, force %+.2f %%, least P %.2f of the largest\n", ka,
                edges_per_wavelength(mesh, wave().wavelength()), 100.0 * error, 100.0 * force_error,
                exact.minCoeff() / exact.maxCoeff());
    EXPECT_LT(error, 0.03);
    EXPECT_LT(std::abs(force_error), 0.02);
    EXPECT_LT(exact.minCoeff(), 0.0);  // there is suction, so the flow along the skin is tested
  }
}

}  // namespace touchfield::surface_gradient_test
