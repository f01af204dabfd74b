#include "tests/hard/hard_support.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/topology.h"
#include "tests/support/mesh_support.h"

namespace touchfield {

Wave wave_at(double frequency) { return {air(293.15), frequency}; }

SolverOptions usual_solver(Scheme scheme) {
  SolverOptions options;
  options.tolerance = 1e-6;  // what is measured here is the discretisation alone
  if (scheme != Scheme::kBurtonMiller && scheme != Scheme::kBurtonMillerPolished) {
    options.kind = SolverKind::kLu;
  }
  return options;
}

Answer answer(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array, Scheme scheme,
              const SolverOptions& options) {
  const ScatteringSystem system(mesh, wave, scheme);
  const IncidentField incident = system.incident(array, Eigen::MatrixXcd::Ones(array.size(), 1));
  const auto solver = make_solver(system, options);
  const Solved solved = solver->solve(system.right_hand_side(incident));
  return {system.pressure(solved.x, incident), solved.report, solver->reciprocal_condition()};
}

namespace {

constexpr double kSameSolution = 1e-4;  // of two solutions to 1e-6, whatever the condition

/// The preconditioner leaves the solution as it is, on any body.
void expect_same_on_two_levels(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array, Scheme scheme,
                               Answer& plain) {
  SolverOptions options = usual_solver(scheme);
  options.two_level = true;
  const Answer found = answer(mesh, wave, array, scheme, options);
  plain.two_level_steps = found.report.steps;
  if (plain.report.converged) {
    EXPECT_TRUE(found.report.converged);
    EXPECT_LT((found.pressure - plain.pressure).norm(), kSameSolution * plain.pressure.norm());
  }
}

}  // namespace

Answers answers(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                const std::vector<Scheme>& schemes) {
  Answers all;
  for (const Scheme scheme : schemes) {
    all[scheme] = answer(mesh, wave, array, scheme, usual_solver(scheme));
    if (const SolveReport& report = all[scheme].report; !report.converged) {
      fmt::print("{} has not converged: residual {:.1e} after {} steps\n", to_string(scheme), report.residual,
                 report.steps);
    }
    if (traits(scheme).burton_miller) {
      expect_same_on_two_levels(mesh, wave, array, scheme, all[scheme]);
    }
  }
  return all;
}

Eigen::VectorXcd split_reference(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array, int times) {
  TriangleMesh fine = mesh;
  for (int i = 0; i < times; ++i) {
    fine = split_faces(fine);
  }
  Eigen::VectorXcd p =
      answer(fine, wave, array, Scheme::kBurtonMillerPolished, usual_solver(Scheme::kBurtonMillerPolished)).pressure;
  for (int i = 0; i < times; ++i) {
    p = Eigen::VectorXcd(p(Eigen::seqN(3, p.size() / 4, 4)));  // the middle face has its parent's centroid
  }
  return p;
}

double error(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p, const Eigen::VectorXcd& exact) {
  return std::sqrt(weights.dot((p - exact).cwiseAbs2()) / weights.dot(exact.cwiseAbs2()));
}

double amplitude_error(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p, const Eigen::VectorXcd& exact) {
  return error(weights, p.cwiseAbs().cast<Complex>(), exact.cwiseAbs().cast<Complex>());
}

double mean_amplitude(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p) {
  return std::sqrt(weights.dot(p.cwiseAbs2()) / weights.sum());
}

Errors errors(const Eigen::VectorXd& weights, const Answers& answers, const Eigen::VectorXcd& exact) {
  Errors all;
  for (const auto& [scheme, answer] : answers) {
    all[scheme] = error(weights, answer.pressure, exact);
  }
  return all;
}

std::string letters(Scheme scheme) {
  static const std::map<Scheme, std::string> all = {{Scheme::kPaper, "P"},
                                                    {Scheme::kPaperCorrected, "PC"},
                                                    {Scheme::kChief, "CH"},
                                                    {Scheme::kBurtonMiller, "BM"},
                                                    {Scheme::kBurtonMillerPolished, "BMP"}};
  return all.at(scheme);
}

namespace {

std::string in_percent(double value) {
  return fmt::format("{:.{}f}", 100 * value, value < 0.1 ? 2 : value < 1 ? 1 : 0);
}

}  // namespace

Cells mesh_cells(const TriangleMesh& mesh, const Wave& wave) {
  return {{"epw", fmt::format("{:.1f}", edges_per_wavelength(mesh, wave.wavelength()))},
          {"faces", fmt::to_string(mesh.face_count())}};
}

Cells scheme_cells(const std::vector<Errors>& figures) {
  Cells cells;
  for (const Scheme scheme : all_schemes()) {
    std::vector<std::string> shown;
    for (const Errors& figure : figures) {
      shown.push_back(figure.contains(scheme) ? in_percent(figure.at(scheme)) : "-");
    }
    cells.emplace_back(letters(scheme), fmt::format("{}", fmt::join(shown, " / ")));
  }
  return cells;
}

Cells step_cells(const Answers& answers) {
  const Answer& found = answers.at(Scheme::kBurtonMiller);
  return {{"steps of BM", fmt::to_string(found.report.steps)}, {"two levels", fmt::to_string(found.two_level_steps)}};
}

namespace {

using std::numbers::pi;

constexpr int kRounds = 10;
constexpr double kHalfWall = 1.25e-3;
constexpr double kMiddleRadius = kCupRadius + kHalfWall;

/// The cup is what lies within half a wall of this: a disc in z = -kHalfWall and the cylinder on its rim.
Vector3 on_cup(const Vector3& x) {
  const double r = std::hypot(x.x(), x.y());
  const Vector3 outwards = r > 0 ? Vector3(x.x() / r, x.y() / r, 0) : Vector3::UnitX();
  const Vector3 disc = std::min(r, kMiddleRadius) * outwards - kHalfWall * Vector3::UnitZ();
  const double height = std::clamp(x.z(), -kHalfWall, kCupDepth - kHalfWall);
  const Vector3 side = kMiddleRadius * outwards + height * Vector3::UnitZ();
  const Vector3 middle = (x - disc).squaredNorm() < (x - side).squaredNorm() ? disc : side;
  return middle + kHalfWall * (x - middle).normalized();
}

/// The outline from the outer bottom over the rim to the floor, as (r, z), points about `step` apart.
std::vector<Eigen::Vector2d> cup_outline(double step) {
  std::vector<Eigen::Vector2d> outline;
  const auto line = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    const int count = std::max(1, static_cast<int>(std::ceil((to - from).norm() / step)));
    for (int i = 0; i < count; ++i) {
      outline.emplace_back(from + (to - from) * i / count);
    }
  };
  const auto arc = [&](double z, double from, double to) {
    const int count = std::max(2, static_cast<int>(std::ceil(kHalfWall * std::abs(to - from) / step)));
    for (int i = 0; i < count; ++i) {
      const double turn = from + (to - from) * i / count;
      outline.emplace_back(kMiddleRadius + kHalfWall * std::cos(turn), z + kHalfWall * std::sin(turn));
    }
  };
  const double outer = kMiddleRadius + kHalfWall;
  const double rim = kCupDepth - kHalfWall;
  line({0, -2 * kHalfWall}, {kMiddleRadius, -2 * kHalfWall});
  arc(-kHalfWall, -0.5 * pi, 0);
  line({outer, -kHalfWall}, {outer, rim});
  arc(rim, 0, pi);
  line({kCupRadius, rim}, {kCupRadius, 0});
  line({kCupRadius, 0}, {0, 0});
  return outline;  // without the last point, the middle of the floor
}

}  // namespace

TriangleMesh finger(double edge) { return capsule(8e-3, 20e-3, edge).mesh; }

TriangleMesh pair_of(const TriangleMesh& mesh, double gap) {
  const double width = mesh.vertices().row(0).maxCoeff() - mesh.vertices().row(0).minCoeff();
  return together(mesh, shifted(mesh, {width + gap, 0, 0}));
}

TriangleMesh with_slivers(const TriangleMesh& mesh, double angle) {
  constexpr Eigen::Index kEvery = 4;
  const Eigen::Index cut = (mesh.face_count() + kEvery - 1) / kEvery;
  Points vertices(3, mesh.vertex_count() + cut);
  vertices.leftCols(mesh.vertex_count()) = mesh.vertices();
  Triangles triangles(3, mesh.face_count() + 2 * cut);
  Eigen::Index faces = 0;
  Eigen::Index points = mesh.vertex_count();
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Eigen::Vector3i face = mesh.triangles().col(f);
    if (f % kEvery != 0) {
      triangles.col(faces++) = face;
      continue;
    }
    const Vector3 a = mesh.corner(f, 0);
    const Vector3 b = mesh.corner(f, 1);
    const Vector3 c = mesh.corner(f, 2);
    if (f % (2 * kEvery) == 0) {
      const Vector3 up = mesh.normals().col(f).cross(b - a).normalized();
      vertices.col(points) = 0.5 * (a + b) + 0.5 * (b - a).norm() * std::tan(angle) * up;
    } else {
      // On the bisector of an equilateral corner, at a distance seen from the others under the angle.
      const Vector3 along = ((b - a).normalized() + (c - a).normalized()).normalized();
      const double slope = std::tan(angle);
      vertices.col(points) = a + (b - a).norm() * slope / (0.5 + std::sqrt(0.75) * slope) * along;
    }
    const auto d = static_cast<int>(points++);
    triangles.col(faces++) << face(0), face(1), d;
    triangles.col(faces++) << face(1), face(2), d;
    triangles.col(faces++) << face(2), face(0), d;
  }
  return {vertices, triangles};
}

TriangleMesh graded_sphere(double radius, double finest, double coarsest, double growth) {
  const TriangleMesh start = icosphere(radius, 8);
  const Vector3 pole(0, 0, radius);
  const RemeshTarget target{[&](const Points& points) {
                              const Eigen::VectorXd from_pole = (points.colwise() - pole).colwise().norm().transpose();
                              return Eigen::VectorXd((finest + growth * from_pole.array()).min(coarsest).matrix());
                            },
                            [&](Points& points) { points = radius * points.colwise().normalized(); }};
  // Every round halves edges at most once.
  const TriangleMesh mesh = remeshed(start.vertices(), start.triangles(), target, 2 * kRounds);
  const double scale = std::cbrt(4.0 / 3.0 * pi * radius * radius * radius / mesh.signed_volume());
  return {scale * mesh.vertices(), mesh.triangles()};
}

TriangleMesh cup(double edge) {
  const std::vector<Eigen::Vector2d> outline = cup_outline(edge);
  const int around = static_cast<int>(std::ceil(2.0 * pi * (kMiddleRadius + kHalfWall) / edge));
  const int rings = static_cast<int>(outline.size()) - 1;
  const int bottom = rings * around;
  Points points(3, bottom + 2);
  for (int ring = 0; ring < rings; ++ring) {
    const Eigen::Vector2d& at = outline[static_cast<std::size_t>(ring) + 1];
    for (int i = 0; i < around; ++i) {
      const double turn = 2.0 * pi * (i + 0.5 * (ring % 2)) / around;
      points.col(ring * around + i) << at.x() * std::cos(turn), at.x() * std::sin(turn), at.y();
    }
  }
  points.col(bottom) << 0, 0, -2 * kHalfWall;
  points.col(bottom + 1) << 0, 0, 0;
  Triangles triangles(3, 2 * rings * around);
  Eigen::Index count = 0;
  for (int i = 0; i < around; ++i) {
    const int next = (i + 1) % around;
    triangles.col(count++) << bottom, next, i;
    for (int ring = 0; ring + 1 < rings; ++ring) {
      const int below = ring * around;
      const int above = below + around;
      triangles.col(count++) << below + i, below + next, above + i;
      triangles.col(count++) << below + next, above + next, above + i;
    }
    triangles.col(count++) << (rings - 1) * around + i, (rings - 1) * around + next, bottom + 1;
  }
  const RemeshTarget target{
      [&](const Points& at) { return Eigen::VectorXd(Eigen::VectorXd::Constant(at.cols(), edge)); },
      [&](Points& at) {
        for (Eigen::Index i = 0; i < at.cols(); ++i) {
          at.col(i) = on_cup(at.col(i));
        }
      }};
  return remeshed(points, triangles, target, kRounds);
}

}  // namespace touchfield
