// Radiation forces on a rigid sphere in a plane wave against their series, as CSV: from pressures given exactly at the
// centroids and from boundary elements, by the estimate of the gradient that the program uses, by the one of pressures
// averaged to the vertices, and with the exact gradient, which leaves the error of flat faces alone.
//
//   net        force along the wave's travel          inwards    sum of area times radiation pressure
//   kinetic    its part from grad_t p alone           gradient   L2 of grad_t p itself; all relative to the series'
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <Eigen/Geometry>

#include "sim/field/surface_gradient.h"
#include "tests/support/sphere_support.h"

namespace touchfield {
namespace {

/// Pressures averaged to the vertices by area, linear on each face.
Eigen::Matrix3Xcd vertex_gradient(const TriangleMesh& mesh, const Eigen::VectorXcd& pressure) {
  Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(mesh.vertex_count());
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(mesh.vertex_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      sum(mesh.triangles()(c, f)) += mesh.areas()(f) * pressure(f);
      weight(mesh.triangles()(c, f)) += mesh.areas()(f);
    }
  }
  Eigen::Matrix3Xcd gradient = Eigen::Matrix3Xcd::Zero(3, mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int v = mesh.triangles()(c, f);
      const Vector3 opposite = mesh.corner(f, (c + 2) % 3) - mesh.corner(f, (c + 1) % 3);
      const Vector3 slope = Vector3(mesh.normals().col(f)).cross(opposite) / (2.0 * mesh.areas()(f));
      gradient.col(f) += sum(v) / weight(v) * slope;
    }
  }
  return gradient;
}

/// dp/dtheta / a of the series, by central differences.
Eigen::VectorXcd series_slope(double radius, const Eigen::VectorXd& angle) {
  constexpr double kStep = 1e-5;
  const auto at = [&](double turn) {
    return rigid_sphere_plane_wave(wave(), radius, (angle.array() + turn).cos().matrix());
  };
  return (at(kStep) - at(-kStep)) / (2.0 * kStep * radius);
}

Eigen::Matrix3Xcd series_gradient(const TriangleMesh& mesh, double radius) {
  const Eigen::VectorXd cosine = cosines(mesh);
  const Eigen::VectorXcd slope = series_slope(radius, cosine.array().acos().matrix());
  Eigen::Matrix3Xcd gradient(3, mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 outwards = mesh.centroids().col(f).normalized();
    const Vector3 away = (cosine(f) * outwards - Vector3::UnitZ()).normalized();  // where theta grows
    gradient.col(f) = slope(f) * away;
  }
  return gradient;
}

struct Sums {
  double inwards;
  double kinetic;
};

double potential() {
  const Wave w = wave();
  return 1.0 / (4.0 * w.medium().density * std::pow(w.medium().sound_speed, 2));
}

double kinetic_per_square() { return potential() / std::pow(wave().k(), 2); }

Sums series_sums(double radius) {
  constexpr Eigen::Index kRings = 4000;
  const double ring = std::numbers::pi / static_cast<double>(kRings);
  const Eigen::VectorXd angle = Eigen::VectorXd::LinSpaced(kRings, 0.5 * ring, std::numbers::pi - 0.5 * ring);
  const Eigen::ArrayXd area = 2.0 * std::numbers::pi * radius * radius * ring * angle.array().sin();
  const Eigen::ArrayXd kinetic = kinetic_per_square() * series_slope(radius, angle).cwiseAbs2().array();
  const Eigen::ArrayXd square = rigid_sphere_plane_wave(wave(), radius, angle.array().cos().matrix()).cwiseAbs2();
  return {(area * (potential() * square - kinetic)).sum(), (area * kinetic).sum()};
}

void print_sphere(double ka, int subdivisions) {
  const double radius = radius_of(ka);
  const TriangleMesh mesh = icosphere(radius, subdivisions);
  const Sums exact = series_sums(radius);
  const double net = rigid_sphere_force(wave(), radius, 1.0);
  const Eigen::Matrix3Xcd slopes = series_gradient(mesh, radius);
  const SurfaceGradient gradient(mesh, wave().k());
  const std::array<std::pair<const char*, Eigen::VectorXcd>, 2> pressures = {
      {{"series", rigid_sphere_plane_wave(wave(), radius, cosines(mesh))},
       {"burton_miller_polished",
        solve_sphere(Scheme::kBurtonMillerPolished, {.ka = ka, .subdivisions = subdivisions}).pressure}}};
  for (const auto& [source, p] : pressures) {
    const std::array<std::pair<const char*, Eigen::Matrix3Xcd>, 3> estimates = {
        {{"vertex_means", vertex_gradient(mesh, p)}, {"kriging", gradient.of(p)}, {"series", slopes}}};
    for (const auto& [estimate, slope] : estimates) {
      const Eigen::VectorXd kinetic =
          kinetic_per_square() * mesh.areas().cwiseProduct(slope.colwise().squaredNorm().transpose());
      const Eigen::VectorXd force = potential() * mesh.areas().cwiseProduct(p.cwiseAbs2()) - kinetic;
      const double difference = std::sqrt((slope - slopes).colwise().squaredNorm().dot(mesh.areas()) /
                                          slopes.colwise().squaredNorm().dot(mesh.areas()));
      std::printf("%.4f,%.2f,%d,%s,%s,%.5f,%.5f,%.5f,%.5f\n", ka, edges_per_wavelength(mesh, wave().wavelength()),
                  static_cast<int>(mesh.face_count()), source, estimate,
                  -force.dot(mesh.normals().row(2).transpose()) / net - 1.0, force.sum() / exact.inwards - 1.0,
                  kinetic.sum() / exact.kinetic - 1.0, difference);
    }
  }
  std::fflush(stdout);
}

}  // namespace
}  // namespace touchfield

int main() {
  std::puts("ka,edges_a_wavelength,faces,pressures,gradient,net_error,inwards_error,kinetic_error,gradient_error");
  for (const int subdivisions : {4, 5, 6, 8, 10, 16}) {  // 3.2 to 12.8 edges a wavelength
    touchfield::print_sphere(6.52, subdivisions);
  }
  for (const int subdivisions : {8, 10, 12, 16, 20}) {  // 3.2 to 8
    touchfield::print_sphere(13.04, subdivisions);
  }
  return 0;
}
