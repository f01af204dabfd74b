#include "sim/bem/quadrature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/reference_kernels.h"
#include "tests/support/table_row.h"

namespace touchfield::quadrature_test {

using std::numbers::pi;

Face make_face(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 twice = (b - a).cross(c - a);
  return {a, b, c, twice.normalized(), 0.5 * twice.norm()};
}

/// Tanh-sinh nodes and weights on 0..1: converges past the near-singular spikes that defeat polynomial rules.
struct TanhSinh {
  std::vector<double> x;
  std::vector<double> w;

  TanhSinh() {
    constexpr double kStep = 1.0 / 20.0;
    for (int i = -69; i <= 69; ++i) {
      const double t = i * kStep;
      const double u = 0.5 * pi * std::sinh(t);
      x.push_back(1.0 / (1.0 + std::exp(-2.0 * u)));  // keeps its digits near 0, where the spike sits
      w.push_back(0.25 * kStep * pi * std::cosh(t) / (std::cosh(u) * std::cosh(u)));
    }
  }
};

/// Point of the segment from a to b nearest to x.
Vector3 nearest_on_segment(const Vector3& a, const Vector3& b, const Vector3& x) {
  return a + std::clamp((b - a).dot(x - a) / (b - a).squaredNorm(), 0.0, 1.0) * (b - a);
}

Vector3 nearest_on_face(const Face& face, const Vector3& x) {
  const std::array<Vector3, 3> corners = {face.a, face.b, face.c};
  const Vector3 foot = x - face.normal.dot(x - face.a) * face.normal;
  bool within = true;
  Vector3 nearest = face.a;
  for (std::size_t e = 0; e < 3; ++e) {
    const Vector3& b = corners[e];
    const Vector3& c = corners[(e + 1) % 3];
    within = within && face.normal.dot((c - b).cross(foot - b)) >= 0;
    const Vector3 candidate = nearest_on_segment(b, c, x);
    nearest = (candidate - x).norm() < (nearest - x).norm() ? candidate : nearest;
  }
  return within ? foot : nearest;
}

/// Integral of kernel(y) over a face, the kernel smooth but for a spike or a 1/r at x, by tanh-sinh in both directions
/// on triangles that have their corner at the point nearest to x and right angles at the edges: whatever is nearly
/// singular sits at the end of a range. About 1e-12 relative to the integral of the kernel's magnitude.
template <typename Kernel>
auto reference_integral(const Face& face, const Vector3& x, const Kernel& kernel) {
  static const TanhSinh rule;
  const Vector3 apex = nearest_on_face(face, x);
  const std::array<Vector3, 3> corners = {face.a, face.b, face.c};
  decltype(kernel(apex)) sum = kernel(corners[0]) * 0.0;
  const auto add = [&](const Vector3& b, const Vector3& c) {
    const double twice_area = face.normal.dot((b - apex).cross(c - apex));
    if (twice_area < 1e-12 * face.area) {
      return;
    }
    for (std::size_t i = 0; i < rule.x.size(); ++i) {
      for (std::size_t j = 0; j < rule.x.size(); ++j) {
        const Vector3 y = apex + rule.x[i] * ((b - apex) + rule.x[j] * (c - b));
        if ((x - y).norm() > 0) {
          sum = sum + kernel(y) * (rule.w[i] * rule.w[j] * rule.x[i] * twice_area);
        }
      }
    }
  };
  for (std::size_t e = 0; e < 3; ++e) {
    const Vector3& b = corners[e];
    const Vector3& c = corners[(e + 1) % 3];
    const Vector3 foot = nearest_on_segment(b, c, apex);
    // The spike sits at the start of each range of j as well.
    add(b, foot);
    add(foot, c);
  }
  return sum;
}

const Complex kWavenumber(732.28, 0.152);  // 40 kHz
constexpr double kGamma = 1.0 / 732.28;
constexpr double kEdge = 1.7e-3;  // a fifth of a wavelength
const double kHeight = kEdge * std::sqrt(3.0) / 2.0;

/// Equilateral, its first edge along x, its third corner on +y, normal +z.
Face equilateral() { return make_face(Vector3::Zero(), Vector3(kEdge, 0, 0), Vector3(kEdge / 2, kHeight, 0)); }

Face scalene() { return make_face({0.1e-3, -0.2e-3, 0.3e-3}, {2.9e-3, 0.4e-3, 0.1e-3}, {0.8e-3, 2.2e-3, -0.4e-3}); }

/// S, D, D' and W.
using Integrals = Eigen::Array4cd;

/// Errors of S, D, D' and W of one face: of D and D' as they are, the half space having 1/2; of S and W in units of
/// the integral of the kernel's magnitude, for W itself can vanish.
Eigen::Array4d errors(const Face& face, const Vector3& x, const Vector3& m) {
  using Both = Eigen::Array<Complex, 4, 2>;  // the integrals and those of the magnitudes
  const Both reference = reference_integral(face, x, [&](const Vector3& y) -> Both {
    const ReferenceKernels kernels = reference_kernels(x, m, y, face.normal, kWavenumber);
    const Integrals values(kernels.single, kernels.dual, kernels.adjoint, kernels.hypersingular);
    Both both;
    both << values, values.abs().cast<Complex>();
    return both;
  });
  FaceQuadrature quadrature(kWavenumber, kGamma, {});
  quadrature.begin(x, m);
  quadrature.add(face);
  const auto value = [&](Layer layer) -> Complex { return quadrature.integrals(layer)[0]; };
  const Complex dual = value(Layer::kDouble);
  const Complex w = (value(Layer::kBurtonMiller) - dual) / Complex(0, kGamma);
  const Integrals values(value(Layer::kSingle), dual, value(Layer::kAdjoint), w);
  Eigen::Array4d error = (values - reference.col(0)).abs();
  error(0) /= reference(0, 1).real();
  error(3) /= reference(3, 1).real();
  return error;
}

struct Bounds {
  double single, dual, adjoint, hypersingular;
};

/// The errors found, too.
Eigen::Array4d expect_errors(const Face& face, const Vector3& x, const Vector3& m, const Bounds& bounds,
                             const std::string& where) {
  const Eigen::Array4d found = errors(face, x, m);
  EXPECT_LT(found(0), bounds.single) << "S " << where;
  EXPECT_LT(found(1), bounds.dual) << "D " << where;
  EXPECT_LT(found(2), bounds.adjoint) << "D' " << where;
  EXPECT_LT(found(3), bounds.hypersingular) << "W " << where;
  return found;
}

/// A row of results/tables/face_integrals.csv: the largest errors of a class of places.
void print_errors(const std::string& where, const Eigen::Array4d& worst) {
  const auto cell = [&](int i) { return worst(i) < 1e-15 ? "0" : fmt::format("{:.1e}", worst(i)); };
  print_row("face_integrals", {{{"where", where}, {"S", cell(0)}, {"D", cell(1)}, {"D'", cell(2)}, {"W", cell(3)}}});
}

TEST(ElementIntegrals, KernelIsTheNormalDerivativeOfG) {
  const Complex k(732.28, 0.152);
  const Vector3 x(0.01, 0.02, -0.005);
  const Vector3 y(0.004, -0.003, 0.001);
  const Vector3 n = Vector3(1, 2, -2) / 3.0;
  const auto g = [&](const Vector3& at) {
    const double r = (x - at).norm();
    return std::exp(Complex(0, 1) * k * r) / (4.0 * pi * r);
  };
  constexpr double kStep = 1e-7;
  const Complex difference = (g(y + kStep * n) - g(y - kStep * n)) / (2 * kStep);
  const Complex kernel = double_layer_kernel(x - y, n, k);
  EXPECT_LT(std::abs(kernel - difference), 1e-6 * std::abs(kernel));
  EXPECT_NEAR(double_layer_kernel(x - y, n, 1e-9).real(), static_double_layer_kernel(x - y, n), 1e-9);
}

TEST(ElementIntegrals, SolidAngleOfAnOctantAndItsSigns) {
  // The face through the unit points of the axes is seen from the origin as one eighth of the sphere.
  const Face octant = make_face({1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(solid_angle(octant, Vector3::Zero()), -4.0 * pi / 8.0, 1e-14);  // behind the normal
  const Vector3 mirrored = Vector3::Constant(2.0 / 3.0);
  EXPECT_NEAR(solid_angle(octant, mirrored), 4.0 * pi / 8.0, 1e-14);
  // Just above an inner point the face fills half the sphere.
  const Vector3 middle = Vector3::Constant(1.0 / 3.0);
  EXPECT_NEAR(solid_angle(octant, middle + 1e-9 * octant.normal), 2.0 * pi, 1e-7);
  EXPECT_NEAR(solid_angle(octant, middle - 1e-9 * octant.normal), -2.0 * pi, 1e-7);
  // In the plane but outside: nothing.
  EXPECT_NEAR(solid_angle(octant, Vector3(3, -1, -1)), 0.0, 1e-14);
}

// What the default rule reaches, with a fifth to spare. The static parts of D and W are exact, which leaves what k
// adds; S and D' are integrated by points alone. Faces beyond 3 sizes, 2 edges, have 3 points.
TEST(Quadrature, CoplanarNeighbours) {
  const Face face = equilateral();
  Eigen::Array4d worst = Eigen::Array4d::Zero();
  for (const Vector3& x : {Vector3(kEdge / 2, -kHeight / 3, 0),     // shares the first edge
                           Vector3(-kEdge / 2, -kHeight / 3, 0),    // shares the first corner,
                           Vector3(-kEdge / 2, kHeight / 3, 0)}) {  // in the next sector
    worst = worst.max(expect_errors(face, x, Vector3::UnitZ(), {2.3e-4, 1e-15, 1e-15, 1e-4},
                                    fmt::format("x {:.2f}, y {:.2f} edges", x.x() / kEdge, x.y() / kEdge)));
  }
  print_errors("coplanar neighbours", worst);
}

TEST(Quadrature, NeighboursRoundASharedEdge) {
  const Face face = equilateral();
  Eigen::Array4d worst = Eigen::Array4d::Zero();
  for (const double degrees : {60.0, 90.0, 120.0, 150.0, 170.0}) {  // 180: coplanar
    const double angle = degrees * pi / 180.0;
    const Vector3 along(0, std::cos(angle), std::sin(angle));
    const Vector3 x = Vector3(kEdge / 2, 0, 0) + kHeight / 3 * along;
    const Vector3 m(0, std::sin(angle), -std::cos(angle));
    worst = worst.max(expect_errors(face, x, m, {1.1e-4, 6e-7, 5e-5, 2e-5}, fmt::format("dihedral angle {}", degrees)));
  }
  print_errors("neighbours at 60 to 170 degrees", worst);
}

TEST(Quadrature, PointsOffAFace) {
  const Vector3 m = Vector3(0.3, -0.5, 0.8).normalized();
  const Vector3 up = Vector3::UnitZ();
  const Vector3 out = -Vector3::UnitY();
  const struct {
    double distance;  // edges
    Bounds bounds;
  } classes[] = {{2.0, {7e-4, 1e-5, 9e-6, 1.5e-3}},   {1.0, {9e-5, 2e-6, 1.5e-5, 1.4e-4}},
                 {0.5, {2e-4, 2e-6, 1.3e-5, 1.2e-4}}, {0.25, {8e-5, 6e-7, 4e-5, 2.5e-5}},
                 {0.1, {2e-5, 1.5e-7, 6e-5, 5e-6}},   {0.05, {5e-5, 3e-7, 1.4e-4, 1e-6}}};
  const Vector3 centroid(kEdge / 2, kHeight / 3, 0);
  const Vector3 inside(0.4 * kEdge, 0.2 * kHeight, 0);
  const Vector3 on_edge(0.4 * kEdge, 0, 0);
  for (const auto& c : classes) {
    const double d = c.distance * kEdge;
    const Face face = equilateral();
    Eigen::Array4d worst = Eigen::Array4d::Zero();
    const auto check = [&](const Vector3& x, const char* where) {
      worst = worst.max(expect_errors(face, x, m, c.bounds, fmt::format("{} edges {}", c.distance, where)));
    };
    check(centroid + d * up, "above the centroid");
    check(inside + d * up, "above an inner point");
    check(inside - d * up, "below an inner point");
    check(on_edge + d * up, "above an edge");
    check(on_edge + d * out, "beyond an edge");
    check(on_edge + d * (up + out).normalized(), "beyond an edge and above");
    check(d * Vector3(-0.7, -0.3, 0.648), "off a corner");
    print_errors(fmt::format("{} edge{} off", c.distance, c.distance == 1 ? "" : "s"), worst);
  }
}

struct SelfReference {
  Complex single;
  Complex hypersingular;
};

/// W's finite part: the static one is the slope of D0 = solid angle / 4 pi just above the face, where D0 = 1/2 + s z +
/// O(z^3); what is left, ((1 - ikr) exp(ikr) - 1) / (4 pi r^3), is integrable.
SelfReference self_reference(const Face& face, const Complex& wavenumber) {
  const Vector3 x = (face.a + face.b + face.c) / 3.0;
  const double longest = std::max({(face.b - face.a).norm(), (face.c - face.b).norm(), (face.a - face.c).norm()});
  const double nearest = 2.0 / 3.0 * face.area / longest;  // of the edges
  const auto slope = [&](double z) {
    return (solid_angle(face, x + z * nearest * face.normal) / (4.0 * pi) - 0.5) / (z * nearest);
  };
  constexpr double kStep = 0.02;  // of Richardson's scheme: the sixth power of it is left
  const double coarse = (4.0 * slope(kStep / 2) - slope(kStep)) / 3.0;
  const double fine = (4.0 * slope(kStep / 4) - slope(kStep / 2)) / 3.0;
  const Eigen::Array2cd rest = reference_integral(face, x, [&](const Vector3& y) -> Eigen::Array2cd {
    const double r = (x - y).norm();
    const Complex ikr = Complex(0, 1) * wavenumber * r;
    Complex lack = (1.0 - ikr) * std::exp(ikr) - 1.0;
    if (std::abs(ikr) < 1e-2) {  // the difference loses digits: sum over n >= 2 of (1 - n) (ikr)^n / n!
      lack = -ikr * ikr / 2.0 - ikr * ikr * ikr / 3.0 - std::pow(ikr, 4) / 8.0 - std::pow(ikr, 5) / 30.0;
    }
    return {std::exp(ikr) / (4.0 * pi * r), lack / (4.0 * pi * r * r * r)};
  });
  return {rest(0), (16.0 * fine - coarse) / 15.0 + rest(1)};
}

TEST(SelfIntegrals, AgainstTheSlopeOfTheSolidAngleAndTanhSinh) {
  const auto right = [](double degrees) {
    return make_face(Vector3::Zero(), {4e-3, 0, 0}, {0, 4e-3 * std::tan(degrees * pi / 180), 0});
  };
  const auto isosceles = [](double degrees) {
    return make_face(Vector3::Zero(), {4e-3, 0, 0}, {2e-3, 2e-3 * std::tan(degrees * pi / 180), 0});
  };
  const struct {
    Face face;
    double tolerance;
    const char* name;
  } cases[] = {{equilateral(), 1e-9, "equilateral"},     {scalene(), 1e-9, "scalene"},
               {right(20.0), 1e-9, "right, 20 degrees"}, {isosceles(20.0), 1e-9, "isosceles, 20 degrees"},
               {right(5.0), 1e-9, "right, 5 degrees"},   {isosceles(5.0), 1e-9, "isosceles, 5 degrees"},
               {right(1.0), 1e-5, "right, 1 degree"},    {isosceles(1.0), 1e-5, "isosceles, 1 degree"}};
  std::map<double, Eigen::Array4d> worst;  // by the tolerance
  for (const auto& c : cases) {
    Eigen::Array4d& most = worst.try_emplace(c.tolerance, Eigen::Array4d::Zero()).first->second;
    for (const Complex& wavenumber : {Complex(732.28, 0), Complex(732.28, 20.0), Complex(183.0, 0.1)}) {
      const SelfIntegrals values = self_integrals(c.face, wavenumber);
      const SelfReference expected = self_reference(c.face, wavenumber);
      // D and D' vanish on a flat face.
      const Eigen::Array4d found(std::abs(values.single / expected.single - 1.0), 0, 0,
                                 std::abs(values.hypersingular / expected.hypersingular - 1.0));
      EXPECT_LT(found(0), c.tolerance) << "S " << c.name << wavenumber;
      EXPECT_LT(found(3), c.tolerance) << "W " << c.name << wavenumber;
      most = most.max(found);
    }
  }
  print_errors("itself, angles of 5 degrees and more", worst.at(1e-9));
  print_errors("itself, 1 degree", worst.at(1e-5));
}

}  // namespace touchfield::quadrature_test
