#include "sim/mesh/remesh/resurface.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "tests/support/mesh_support.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"

namespace touchfield::resurface_test {

Resurfaced resurface(const FileSurface& surface, double edge) {
  Resurfaced result = resurfaced(surface, 1.0, edge, "skin.stl", "--resurface");
  EXPECT_THAT(inspect_skin(result.mesh.vertices(), result.mesh.triangles()).faults, IsEmpty());
  return result;
}

std::string refusal(const FileSurface& surface, double edge) {
  const std::string message =
      message_of<InputError>([&] { resurfaced(surface, 1.0, edge, "skin.stl", "--resurface"); });
  EXPECT_THAT(message, StartsWith("skin.stl: "));
  return message;
}

double ball_volume(double radius) { return 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3); }

FileSurface ball(double radius, const Vector3& at = Vector3::Zero()) {
  return file_of(transformed(icosphere(radius, 8), Eigen::Matrix3d::Identity(), at));
}

void expect_near_the_original(const TriangleMesh& mesh, double edge) {
  const Resurfaced result = resurface(file_of(mesh), edge);
  EXPECT_NEAR(result.mesh.signed_volume(), mesh.signed_volume(), 0.01 * mesh.signed_volume());
  EXPECT_GT(result.to_skin.counted, 0.99);
  EXPECT_LT(result.to_skin.most_of_it, edge / 3.0);
  EXPECT_LT(result.from_skin.most_of_it, edge / 3.0);
  EXPECT_LT(result.to_skin.farthest, edge);
  EXPECT_LT(result.from_skin.farthest, edge);
  EXPECT_NEAR(result.mesh.mean_edge(), edge, 0.05 * edge);
  EXPECT_GT(smallest_angles(result.mesh).minCoeff(), 15.0 / 180.0 * std::numbers::pi);
}

TEST(Resurface, KeepsABoxButForItsEdges) { expect_near_the_original(box({30e-3, 40e-3, 25e-3}, 5e-3).mesh, 1.5e-3); }
TEST(Resurface, KeepsAHand) { expect_near_the_original(hand({.pose = "index_up", .edge = 3e-3}).mesh, 2.5e-3); }

// Two balls of radius R, their centres d apart: the lens is pi (2R - d)^2 (d^2 + 4 d R) / (12 d).
TEST(Resurface, OverlappingBallsBecomeOne) {
  const double radius = 10e-3;
  const double apart = 12e-3;
  const Resurfaced result = resurface(together(ball(radius), ball(radius, {apart, 0, 0})), 1e-3);
  const double lens =
      std::numbers::pi * std::pow(2 * radius - apart, 2) * (apart * apart + 4 * apart * radius) / (12 * apart);
  EXPECT_NEAR(result.mesh.signed_volume(), 2 * ball_volume(radius) - lens, 0.01 * ball_volume(radius));
  EXPECT_EQ(inspect(result.mesh).components, 1);
}

TEST(Resurface, PiecesInsideAndRepeatedFacesAddNothing) {
  const FileSurface outer = ball(15e-3);
  const FileSurface inner = ball(5e-3, {2e-3, 0, 0});
  for (const FileSurface& surface :
       {together(outer, inner), together(outer, turned(inner)), soup_of(together(outer, turned(outer))),
        together(outer, ball(15e-3, {1e-5, 0, 0}))}) {  // of the last no two faces are equal
    const Resurfaced result = resurface(surface, 1.5e-3);
    EXPECT_NEAR(result.mesh.signed_volume(), ball_volume(15e-3), 0.015 * ball_volume(15e-3));
    EXPECT_EQ(inspect(result.mesh).components, 1);
  }
}

/// Without the side z = 10 mm.
FileSurface open_cube() {
  FileSurface surface = file_of(cube());
  surface.triangles.erase(surface.triangles.begin() + 2, surface.triangles.begin() + 4);
  return surface;
}

TEST(Resurface, TheSideThatFacesLookToDoesNotMatter) {
  FileSurface flipped = open_cube();
  for (std::size_t f = 0; f < flipped.triangles.size(); f += 3) {
    std::swap(flipped.triangles[f][0], flipped.triangles[f][1]);
  }
  const double volume = resurface(open_cube(), 0.5e-3).mesh.signed_volume();
  for (const FileSurface& surface : {turned(open_cube()), soup_of(flipped)}) {
    EXPECT_NEAR(resurface(surface, 0.5e-3).mesh.signed_volume(), volume, 1e-3 * volume);
  }
}

TEST(Resurface, RefusesWhatHasNoVolume) {
  FileSurface sheet = file_of(cube());
  sheet.triangles.resize(2);  // one side
  EXPECT_THAT(refusal(sheet, 1e-3), HasSubstr("no volume"));
  sheet.triangles = {{0, 1, 0}};
  EXPECT_THAT(refusal(sheet, 1e-3), HasSubstr("no face has an area"));
}

TEST(Resurface, RefusesAnEdgeTooLong) {
  EXPECT_THAT(refusal(ball(1e-3), 10e-3), HasSubstr("--resurface = 10 mm is too long"));
  EXPECT_THAT(refusal(file_of(box({30e-3, 30e-3, 0.5e-3}, 3e-3).mesh), 3e-3), HasSubstr("is too long"));
}

TEST(Resurface, RefusesAnEdgeTooShortAndSaysWhatGoes) {
  const std::string nodes = refusal(ball(15e-3), 1e-5);
  EXPECT_THAT(nodes, AllOf(HasSubstr("--resurface = 0.01 mm is too short"), HasSubstr("3e+08 are allowed"),
                           HasSubstr("must be at least 0.0")));
  const FileSurface plate = file_of(box({10.0, 10.0, 1e-3}, 5.0).mesh);
  EXPECT_THAT(refusal(plate, 1.5e-3), HasSubstr("is too short"));
  for (const double edge : {0.0, -1e-3, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THAT(refusal(ball(15e-3), edge), HasSubstr("must be > 0 and finite"));
  }
}

double uniform(std::mt19937_64& random) { return std::ldexp(static_cast<double>(random() >> 11), -53); }

/// A body with faults, and the volume of the skin that becomes of it.
struct Faulty {
  const char* fault;
  FileSurface surface;
  double volume;  // [m3]
};

/// Holes, flaps, walls between bodies, touching and crossing bodies.
std::vector<Faulty> faulty() {
  const FileSurface block = file_of(cube());
  const FileSurface ball = file_of(icosphere(0.05, 8));
  FileSurface flap = ball;
  flap.points.emplace_back(1.05 * flap.points[static_cast<std::size_t>(flap.triangles[7][0])]);
  flap.triangles.push_back(
      {flap.triangles[7][0], flap.triangles[7][1], static_cast<std::int64_t>(flap.points.size()) - 1});
  FileSurface torn = soup_of(block);
  std::mt19937_64 random(1);
  for (Vector3& point : torn.points) {
    point += 0.5e-7 * Vector3(uniform(random), uniform(random), uniform(random));
  }
  const double ball_volume = icosphere(0.05, 8).signed_volume();
  return {{"3 boundary edges", without_face(ball, 100), ball_volume},
          {"1 hole of 40.00 mm", open_cube(), 1e-6},
          {"non-manifold edge", flap, ball_volume},
          {"boundary edges", torn, 1e-6},
          {"non-manifold edge", together(block, file_of(cube({0.01, 0.01, 0}))), 2e-6},
          {"non-manifold vert", together(block, file_of(cube({0.01, 0.01, 0.01}))), 2e-6},
          {"faces intersect", together(block, file_of(cube({0.005, 0.004, 0.003}))), 2e-6 - 5e-3 * 6e-3 * 7e-3}};
}

TEST(Resurface, MendsEveryFault) {
  for (const Faulty& body : faulty()) {
    SCOPED_TRACE(body.fault);
    const Resurfaced result = resurface(body.surface, 0.02 * surface_size(body.surface));
    EXPECT_NEAR(result.mesh.signed_volume(), body.volume, 0.01 * body.volume);
    EXPECT_LT(result.to_skin.most_of_it, 0.05 * std::cbrt(body.volume));
  }
}

TriangleMesh surface_of(const InsideGrid& grid) {
  Isosurface surface = grid.surface();
  TriangleMesh mesh(std::move(surface.points), std::move(surface.triangles));
  const MeshReport report = inspect(mesh);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.nonmanifold_vertices, 0);
  EXPECT_EQ(report.misoriented_edges, 0);
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
  return mesh;
}

TEST(InsideGrid, ErrorsFallWithTheSquareOfTheSpacing) {
  const TriangleMesh ball = icosphere(10e-3, 40);
  const auto error = [&](double spacing) {
    return 1.0 - surface_of(InsideGrid(ball, spacing)).signed_volume() / ball.signed_volume();
  };
  EXPECT_NEAR(error(1e-3) / error(0.5e-3), 4.0, 0.8);
}

}  // namespace touchfield::resurface_test
