// Radiation forces on a rigid sphere in a plane wave against their series, as CSV: from pressures given exactly at the
// centroids and from boundary elements, by the estimate of the gradient that the program uses, by the one of pressures
// averaged to the vertices, and with the exact gradient, which leaves the error of flat faces alone.
//
//   net        force along the wave's travel          inwards    sum of area times radiation pressure
//   kinetic    its part from grad_t p alone           gradient   L2 of grad_t p itself; all relative to the series'
//   radiation  L2 of the radiation pressure
//
// With the argument `hand`: the force on the faces of a whole hand and the momentum that flows in through a sphere
// round it, as CSV. The sound is that of an omnidirectional source 0.1 m from the sphere, on the side of the palm.
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include <Eigen/Geometry>

#include "sim/field/evaluate.h"
#include "sim/field/surface_gradient.h"
#include "sim/hand/hand.h"
#include "tests/support/momentum_support.h"
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

double potential() { return radiation_per_square(wave().medium()); }

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
  const Eigen::VectorXd radiation = potential() * rigid_sphere_plane_wave(wave(), radius, cosines(mesh)).cwiseAbs2() -
                                    kinetic_per_square() * slopes.colwise().squaredNorm().transpose();
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
      const Eigen::VectorXd off = force.cwiseQuotient(mesh.areas()) - radiation;
      const double radiation_error =
          std::sqrt(mesh.areas().dot(off.cwiseAbs2()) / mesh.areas().dot(radiation.cwiseAbs2()));
      std::printf("%.4f,%.2f,%d,%s,%s,%.5f,%.5f,%.5f,%.5f,%.5f\n", ka, edges_per_wavelength(mesh, wave().wavelength()),
                  static_cast<int>(mesh.face_count()), source, estimate,
                  -force.dot(mesh.normals().row(2).transpose()) / net - 1.0, force.sum() / exact.inwards - 1.0,
                  kinetic.sum() / exact.kinetic - 1.0, difference, radiation_error);
    }
  }
  std::fflush(stdout);
}

void print_hand(double frequency, double edge) {
  const Wave sound(air(293.15), frequency);
  const TriangleMesh mesh = hand({.pose = "index_up", .edge = edge}).mesh;
  const Vector3 middle = mesh.vertices().rowwise().mean();
  const double reach = (mesh.vertices().colwise() - middle).colwise().norm().maxCoeff() + 0.01;
  const TransducerArray array = omni_at(middle + Vector3(0.02, 0.03, -(reach + 0.1)));
  const ScatteringSystem system(mesh, sound, Scheme::kBurtonMillerPolished);
  const IncidentField incident = system.incident(array);
  const auto solver = make_solver(system, {.kind = SolverKind::kMatrixFree, .tolerance = 1e-5});
  const Eigen::VectorXcd p = system.pressure(solver->solve(system.right_hand_side(incident)).x, incident);
  const TriangleMesh shell = transformed(icosphere(reach, 32), Eigen::Matrix3d::Identity(), middle);
  const Vector3 inflow = momentum_inflow(shell, sound, [&](const Points& x) -> Eigen::VectorXcd {
    return boundary_integral(mesh, array, sound, x, p, Eigen::MatrixXcd::Ones(1, 1)).pressure;
  });
  std::printf("%.0f,%.1f,%d,%.2f,%.5f\n", 1e-3 * frequency, 1e3 * edge, static_cast<int>(mesh.face_count()),
              edges_per_wavelength(mesh, sound.wavelength()),
              (force_on_faces(mesh, sound, p) - inflow).norm() / inflow.norm());
  std::fflush(stdout);
}

}  // namespace
}  // namespace touchfield

int main(int count, char** arguments) {
  if (count == 2 && std::string(arguments[1]) == "hand") {
    std::puts("frequency_khz,edge_mm,faces,edges_per_wavelength,difference");
    for (const auto& [frequency, edge] : {std::pair{10e3, 4e-3}, {20e3, 5e-3}, {20e3, 4e-3}, {20e3, 3e-3}}) {
      touchfield::print_hand(frequency, edge);
    }
    return 0;
  }
  std::puts(
      "ka,edges_a_wavelength,faces,pressures,gradient,net_error,inwards_error,kinetic_error,gradient_error,"
      "radiation_error");
  for (const int subdivisions : {4, 5, 6, 8, 10, 16}) {  // 3.2 to 12.8 edges a wavelength
    touchfield::print_sphere(6.52, subdivisions);
  }
  for (const int subdivisions : {8, 10, 12, 16, 20}) {  // 3.2 to 8
    touchfield::print_sphere(13.04, subdivisions);
  }
  touchfield::print_sphere(6.0, 7);    // 6.1
  touchfield::print_sphere(13.0, 15);  // 6.0
  return 0;
}
