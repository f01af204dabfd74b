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
  EXPECT_NEAR(*result.original_volume, mesh.signed_volume(), 1e-9 * mesh.signed_volume());
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

// The faces of a sound surface may be far larger or smaller than the new ones.
TEST(Resurface, CoarseAndFineFacesGiveTheSameSkin) {
  const Resurfaced coarse = resurface(file_of(cube()), 1e-3);
  const Resurfaced fine = resurface(file_of(box({10e-3, 10e-3, 10e-3}, 0.3e-3).mesh), 1e-3);
  EXPECT_NEAR(coarse.mesh.signed_volume(), 1e-6, 0.01e-6);
  EXPECT_NEAR(fine.mesh.signed_volume(), coarse.mesh.signed_volume(), 0.005e-6);
}

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

/// An upright cylinder of radius 10 mm and height 40 mm, without its top.
FileSurface cup() {
  constexpr int kRound = 48;
  FileSurface surface;
  surface.points.emplace_back(0, 0, 0);
  for (int i = 0; i < kRound; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRound;
    for (const double z : {0.0, 40e-3}) {
      surface.points.emplace_back(10e-3 * std::cos(angle), 10e-3 * std::sin(angle), z);
    }
  }
  for (std::int64_t i = 0; i < kRound; ++i) {
    const std::int64_t low = 1 + 2 * i;
    const std::int64_t next = 1 + 2 * ((i + 1) % kRound);
    surface.triangles.push_back({0, next, low});
    surface.triangles.push_back({low, next, next + 1});
    surface.triangles.push_back({low, next + 1, low + 1});
  }
  return surface;
}

// From its plane a flat opening hides just half of what is round a point.
TEST(Resurface, AFlatOpeningIsClosedInItsPlane) {
  const Resurfaced result = resurface(cup(), 1e-3);
  const double volume = 24 * std::sin(2 * std::numbers::pi / 48) * 1e-4 * 40e-3;
  EXPECT_NEAR(result.mesh.signed_volume(), volume, 0.01 * volume);
  EXPECT_NEAR(result.mesh.vertices().row(2).maxCoeff(), 40e-3, 0.5e-3);
  EXPECT_FALSE(result.original_volume);
  EXPECT_GT(result.from_skin.farthest, 8e-3);  // the middle of the new top
  EXPECT_LT(result.to_skin.most_of_it, 1e-3 / 3.0);
}

TEST(Resurface, TheSideThatFacesLookToDoesNotMatter) {
  FileSurface flipped = cup();
  std::mt19937_64 random(5);
  for (auto& face : flipped.triangles) {
    if (random() % 3 == 0) {
      std::swap(face[0], face[1]);
    }
  }
  const double volume = resurface(cup(), 1.5e-3).mesh.signed_volume();
  for (const FileSurface& surface : {turned(cup()), soup_of(flipped)}) {
    EXPECT_NEAR(resurface(surface, 1.5e-3).mesh.signed_volume(), volume, 1e-3 * volume);
  }
}

TEST(Resurface, SaysWhatItDid) {
  FileSurface surface = ball(15e-3);
  surface.triangles.push_back(surface.triangles[3]);
  surface = together(surface, ball(1e-3, {25e-3, 0, 0}));
  const Resurfaced result = resurface(surface, 1.5e-3);
  EXPECT_THAT(result.steps, Contains(HasSubstr("left out 1 face ")));
  EXPECT_THAT(result.steps, Contains(HasSubstr("dropped pieces smaller than a cube of the edge")));
  EXPECT_THAT(result.steps, Contains(AllOf(StartsWith("resurfaced with edges of 1.5 mm: "), HasSubstr("area 28."),
                                           HasSubstr("volume 14."))));
  EXPECT_THAT(result.steps, Contains(AllOf(StartsWith("from the outer faces (100.0 %"), HasSubstr("95 % within"))));
  EXPECT_THAT(result.steps, Contains(StartsWith("from the skin to the surface: 95 % within")));
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
  FileSurface open = block;
  open.triangles.erase(open.triangles.begin() + 2, open.triangles.begin() + 4);  // the side z = 10 mm
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
          {"1 hole of 40.00 mm", open, 1e-6},
          {"non-manifold edge", flap, ball_volume},
          {"boundary edges", torn, 1e-6},
          {"non-manifold edge", together(block, file_of(cube({0.01, 0.01, 0}))), 2e-6},
          {"non-manifold vert", together(block, file_of(cube({0.01, 0.01, 0.01}))), 2e-6},
          {"faces intersect", together(block, file_of(cube({0.005, 0.004, 0.003}))), 2e-6 - 5e-3 * 6e-3 * 7e-3}};
}

TEST(Resurface, MendsEveryFault) {
  for (const Faulty& body : faulty()) {
    SCOPED_TRACE(body.fault);
    const Resurfaced result = resurface(body.surface, 0.016 * surface_size(body.surface));
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

// Vertices lie on the faces themselves, so that only the chords between them leave the surface.
TEST(InsideGrid, VerticesLieOnTheFaces) {
  const TriangleMesh ball = icosphere(10e-3, 12);
  const TriangleMesh mesh = surface_of(InsideGrid(ball, 1e-3));
  const FaceTree tree(ball);
  Eigen::Index off = 0;
  for (const Vector3 x : mesh.vertices().colwise()) {
    const double distance = tree.nearest(x).distance;
    off += distance > 1e-5 ? 1 : 0;  // a hundredth of the spacing
    EXPECT_LT(distance, 0.16e-3);    // at single nodes on top, not deeper than (1 mm)^2 / (2 * 10 mm)
  }
  EXPECT_LT(off, mesh.vertex_count() / 100);
  EXPECT_NEAR(mesh.signed_volume(), ball.signed_volume(), 0.01 * ball.signed_volume());
}

TEST(InsideGrid, ErrorsFallWithTheSquareOfTheSpacing) {
  const TriangleMesh ball = icosphere(10e-3, 40);
  const auto error = [&](double spacing) {
    return 1.0 - surface_of(InsideGrid(ball, spacing)).signed_volume() / ball.signed_volume();
  };
  EXPECT_NEAR(error(1e-3) / error(0.5e-3), 4.0, 0.8);
}

// Half a ball's skin: w is 1/2 on the disc through its rim, and nothing but w tells where that is.
TEST(InsideGrid, AHoleIsClosedWhereTheWindingNumberIsAHalf) {
  const TriangleMesh ball = icosphere(10e-3, 16);
  std::vector<int> upper;
  for (Eigen::Index f = 0; f < ball.face_count(); ++f) {
    if (ball.centroids()(2, f) > 0) {
      upper.push_back(static_cast<int>(f));
    }
  }
  const TriangleMesh half(ball.vertices(), ball.triangles()(Eigen::all, upper));
  const TriangleMesh mesh = surface_of(InsideGrid(half, 0.5e-3));
  const FaceTree tree(half);
  for (const Vector3 x : mesh.vertices().colwise()) {
    if (tree.nearest(x).distance > 1e-3) {
      EXPECT_NEAR(tree.winding_number(x), 0.5, 0.02);
    }
  }
  // The dome above its lid, where w = 1/2: lower than the rim's plane by no more than w's fall there.
  EXPECT_GT(mesh.signed_volume(), 0.3 * ball.signed_volume());
  EXPECT_LT(mesh.signed_volume(), 0.55 * ball.signed_volume());
}

TEST(InsideGrid, ThinPartsGoAndNarrowGapsClose) {
  const TriangleMesh plate = box({20e-3, 20e-3, 0.8e-3}, 2e-3).mesh;
  const TriangleMesh block = box({10e-3, 10e-3, 10e-3}, 2e-3).mesh;
  const InsideGrid thin(together(block, shifted(plate, {0, 0, 20e-3})), 1e-3);
  EXPECT_NEAR(surface_of(thin).signed_volume(), 1e-6, 0.05e-6);
  const InsideGrid narrow(together(block, shifted(block, {0, 0, 10.8e-3})), 1e-3);
  EXPECT_EQ(inspect(surface_of(narrow)).components, 1);
}

TEST(InsideGrid, AFlatSheetHasNoInside) {
  Points vertices(3, 3);
  vertices << 0, 10e-3, 0,  //
      0, 0, 10e-3,          //
      0, 0, 0;
  EXPECT_EQ(InsideGrid(TriangleMesh(vertices, Eigen::Vector3i(0, 1, 2)), 1e-3).surface().triangles.cols(), 0);
}

}  // namespace touchfield::resurface_test
