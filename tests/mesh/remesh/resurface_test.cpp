#include "sim/mesh/remesh/resurface.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <Eigen/Geometry>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/mesh_quality.h"
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

TEST(Resurface, KeepsASphere) { expect_near_the_original(sphere(20e-3, 2e-3).mesh, 2e-3); }
TEST(Resurface, KeepsACapsule) { expect_near_the_original(capsule(8e-3, 50e-3, 1.5e-3).mesh, 1.5e-3); }
TEST(Resurface, KeepsABoxButForItsEdges) { expect_near_the_original(box({30e-3, 40e-3, 25e-3}, 5e-3).mesh, 1.5e-3); }
TEST(Resurface, KeepsAHand) { expect_near_the_original(hand({.pose = "index_up", .edge = 3e-3}).mesh, 2.5e-3); }

// The faces of a sound surface may be far larger or smaller than the new ones.
TEST(Resurface, CoarseAndFineFacesGiveTheSameSkin) {
  const Resurfaced coarse = resurface(file_of(cube()), 1e-3);
  const Resurfaced fine = resurface(file_of(box({10e-3, 10e-3, 10e-3}, 0.3e-3).mesh), 1e-3);
  EXPECT_NEAR(coarse.mesh.signed_volume(), 1e-6, 0.01e-6);
  EXPECT_NEAR(fine.mesh.signed_volume(), coarse.mesh.signed_volume(), 0.005e-6);
}

/// A hand whose fingers are folded at the knuckles until they stand in the palm.
TriangleMesh folded_hand() {
  const TriangleMesh flat = hand({.pose = "flat", .edge = 3e-3}).mesh;
  Points vertices = flat.vertices();
  for (auto x : vertices.colwise()) {
    constexpr double kBegin = 95e-3;
    constexpr double kEnd = 115e-3;
    const double share = std::clamp((x.y() - kBegin) / (kEnd - kBegin), 0.0, 1.0);
    const Vector3 pivot(x.x(), 105e-3, -7e-3);
    x = pivot + Eigen::AngleAxisd(-share * 170.0 / 180.0 * std::numbers::pi, Vector3::UnitX()) * (x - pivot);
  }
  return {vertices, flat.triangles()};
}

/// Of what the faces wind round, by counting points of a grid.
double counted_volume(const TriangleMesh& mesh, double spacing) {
  const FaceTree tree(mesh);
  const Vector3 lower = mesh.vertices().rowwise().minCoeff();
  const Eigen::Vector3i count = ((mesh.vertices().rowwise().maxCoeff() - lower) / spacing).array().ceil().cast<int>();
  double inside = 0;
  for (int i = 0; i < count.x(); ++i) {
    for (int j = 0; j < count.y(); ++j) {
      for (int k = 0; k < count.z(); ++k) {
        inside += tree.winding_number(lower + spacing * Vector3(i + 0.5, j + 0.5, k + 0.5)) > 0.5 ? 1.0 : 0.0;
      }
    }
  }
  return inside * std::pow(spacing, 3);
}

TEST(Resurface, FingersInThePalmBecomeOneVolume) {
  const TriangleMesh folded = folded_hand();
  ASSERT_GE(self_intersections(folded, 100).size(), 100);
  const Resurfaced result = resurface(file_of(folded), 2e-3);
  const double volume = counted_volume(folded, 2e-3);
  EXPECT_LT(volume, 0.97 * folded.signed_volume());  // which counts the fingers' tips twice
  EXPECT_NEAR(result.mesh.signed_volume(), volume, 0.01 * volume);
  EXPECT_LT(result.to_skin.counted, 0.98);
  EXPECT_LT(result.to_skin.most_of_it, 2e-3 / 3.0);
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

TEST(Resurface, BallsApartStayApart) {
  const Resurfaced result = resurface(together(ball(10e-3), ball(5e-3, {20e-3, 0, 0})), 1e-3);
  EXPECT_EQ(inspect(result.mesh).components, 2);
  EXPECT_NEAR(result.mesh.signed_volume(), ball_volume(10e-3) + ball_volume(5e-3), 0.01 * ball_volume(10e-3));
}

TEST(Resurface, PiecesInsideAndRepeatedFacesAddNothing) {
  const FileSurface outer = ball(15e-3);
  const FileSurface inner = ball(5e-3, {2e-3, 0, 0});
  for (const FileSurface& surface : {together(outer, inner), together(outer, turned(inner)), together(outer, outer),
                                     together(outer, turned(outer)), soup_of(together(outer, outer))}) {
    const Resurfaced result = resurface(surface, 1.5e-3);
    EXPECT_NEAR(result.mesh.signed_volume(), ball_volume(15e-3), 0.015 * ball_volume(15e-3));
    EXPECT_EQ(inspect(result.mesh).components, 1);
  }
}

// Where the points of copies differ no two faces are equal, and the winding number is 2.
TEST(Resurface, ASurfaceTwiceIsOneSkin) {
  const Resurfaced result = resurface(together(ball(15e-3), ball(15e-3, {1e-5, 0, 0})), 1.5e-3);
  EXPECT_NEAR(result.mesh.signed_volume(), ball_volume(15e-3), 0.015 * ball_volume(15e-3));
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
  for (const FileSurface& surface : {turned(cup()), flipped, soup_of(flipped)}) {
    EXPECT_NEAR(resurface(surface, 1.5e-3).mesh.signed_volume(), volume, 1e-3 * volume);
  }
}

TEST(Resurface, AFlapAddsNothing) {
  FileSurface surface = ball(15e-3);
  const auto [a, b, c] = surface.triangles[0];
  surface.points.emplace_back(2.0 * surface.points[static_cast<std::size_t>(a)]);
  surface.triangles.push_back({a, b, static_cast<std::int64_t>(surface.points.size()) - 1});
  const Resurfaced result = resurface(surface, 1.5e-3);
  EXPECT_NEAR(result.mesh.signed_volume(), ball_volume(15e-3), 0.015 * ball_volume(15e-3));
  EXPECT_LT(result.mesh.vertices().colwise().norm().maxCoeff(), 18e-3);
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

TEST(Resurface, DoesNotDependOnTheOrderOfFaces) {
  FileSurface surface = together(ball(10e-3), ball(8e-3, {9e-3, 3e-3, 1e-3}));
  const Resurfaced one = resurface(surface, 1e-3);
  std::shuffle(surface.triangles.begin(), surface.triangles.end(), std::mt19937_64(2));
  const Resurfaced other = resurface(surface, 1e-3);
  EXPECT_NEAR(one.mesh.signed_volume(), other.mesh.signed_volume(), 1e-3 * one.mesh.signed_volume());
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

// Whatever faces there are: a mesh without fault comes out, or a clear error.
TEST(Resurface, AnyFacesGiveAMeshOrAnError) {
  std::mt19937_64 random(7);
  int made = 0;
  for (int trial = 0; trial < 20; ++trial) {
    FileSurface surface = file_of(icosphere(0.05, 3));
    const auto pick = [&](std::size_t count) { return static_cast<std::size_t>(random() % count); };
    for (int i = 0; i < 1 + trial % 8; ++i) {
      auto& face = surface.triangles[pick(surface.triangles.size())];
      switch (random() % 6) {
        case 0:
          face[pick(3)] = static_cast<std::int64_t>(pick(surface.points.size()));
          break;
        case 1:
          std::swap(face[0], face[1]);
          break;
        case 2:
          surface.points[pick(surface.points.size())] *= uniform(random);
          break;
        case 3:
          surface.triangles.push_back(face);
          break;
        case 4:
          surface.points[pick(surface.points.size())] = surface.points[pick(surface.points.size())];
          break;
        default:
          surface.triangles.erase(surface.triangles.begin() +
                                  static_cast<std::ptrdiff_t>(pick(surface.triangles.size())));
      }
    }
    try {
      resurface(surface, 5e-3);
      ++made;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), StartsWith("skin.stl: ")) << trial;
    }
  }
  EXPECT_GT(made, 14);
}

}  // namespace touchfield::resurface_test
