#include "sim/mesh/repair/repair.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/body/shapes.h"
#include "sim/core/errors.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/repair/repair_steps.h"
#include "sim/mesh/repair/surface_report.h"
#include "tests/support/error_support.h"
#include "tests/support/surface_support.h"

namespace touchfield {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr double kRounding = 1e-14;

Repaired repair(const FileSurface& surface, const RepairOptions& options = {}) {
  Repaired result = repaired(surface, 1.0, options, "skin.stl");
  EXPECT_THAT(inspect_skin(result.mesh.vertices(), result.mesh.triangles()).faults, IsEmpty());
  return result;
}

std::string refusal(const FileSurface& surface, const RepairOptions& options = {}) {
  const std::string message = support::message_of<InputError>([&] { repaired(surface, 1.0, options, "skin.stl"); });
  EXPECT_THAT(message, StartsWith("skin.stl: "));
  return message;
}

double uniform(std::mt19937_64& random) { return std::ldexp(static_cast<double>(random() >> 11), -53); }

TEST(Repair, LeavesAGoodMeshAsItIs) {
  const TriangleMesh ball = icosphere(0.05, 4);
  const Repaired result = repair(file_of(ball));
  EXPECT_THAT(result.steps, IsEmpty());
  EXPECT_EQ(result.mesh.vertices(), ball.vertices());
  EXPECT_EQ(result.mesh.triangles(), ball.triangles());
}

TEST(Repair, WeldsASoup) {
  const Repaired result = repair(soup_of(file_of(cube())));
  EXPECT_EQ(result.mesh.vertex_count(), 8);
  EXPECT_EQ(result.mesh.face_count(), 12);
  EXPECT_NEAR(result.mesh.signed_volume(), 1e-6, kRounding);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("welded 28 points")));  // 36 corners become 8
}

TEST(Repair, WeldsWithinTheToleranceOnly) {
  // Corners off by up to 0.1 um each way, against 0.17 um, 1e-5 of the diagonal of 17 mm; the whole cube is 10 mm.
  FileSurface soup = soup_of(file_of(cube()));
  std::mt19937_64 random(1);
  for (Vector3& point : soup.points) {
    point += 0.5e-7 * Vector3(uniform(random), uniform(random), uniform(random));
  }
  const Repaired result = repair(soup);
  EXPECT_EQ(result.mesh.vertex_count(), 8);
  EXPECT_NEAR(result.mesh.signed_volume(), 1e-6, 3e-4 * 1e-7);  // each side moved by up to 1e-7 m

  RepairOptions narrow;
  narrow.weld = 1e-9;
  EXPECT_THAT(refusal(soup, narrow), HasSubstr("hole"));
  RepairOptions wide;
  wide.weld = 1e-6;
  EXPECT_EQ(repair(soup, wide).mesh.vertex_count(), 8);
}

TEST(Repair, AToleranceOfNothingMergesEqualPoints) {
  RepairOptions exact;
  exact.weld = 0.0;
  EXPECT_EQ(repair(soup_of(file_of(cube())), exact).mesh.vertex_count(), 8);
}

// The tolerance may exceed the cells by which points are found, and chains of near points do not run together.
TEST(Repair, AWideToleranceMovesNoPointFartherThanItself) {
  FileSurface surface = file_of(icosphere(0.05, 6));
  RepairOptions wide;
  wide.weld = 4e-3;  // edges are some 9 mm; half the sphere would run together in a chain of 10 mm
  EXPECT_EQ(repair(surface, wide).mesh.vertex_count(), 362);
}

TEST(Repair, DropsPointsThatNoFaceNames) {
  FileSurface surface = file_of(cube());
  surface.points.insert(surface.points.begin(), Vector3(1e9, 0, 0));
  for (auto& triangle : surface.triangles) {
    for (auto& v : triangle) {
      ++v;
    }
  }
  const Repaired result = repair(surface);
  EXPECT_EQ(result.mesh.vertex_count(), 8);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("dropped 1 point that no face names")));
}

TEST(Repair, DropsCollapsedAndDuplicateFaces) {
  FileSurface surface = file_of(cube());
  surface.triangles.push_back({3, 3, 3});
  surface.triangles.push_back({0, 1, 0});
  surface.triangles.push_back(surface.triangles[4]);
  std::rotate(surface.triangles.back().begin(), surface.triangles.back().begin() + 1, surface.triangles.back().end());
  surface.triangles.push_back({surface.triangles[5][1], surface.triangles[5][0], surface.triangles[5][2]});
  const Repaired result = repair(surface);
  EXPECT_EQ(result.mesh.triangles(), cube().triangles());
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("dropped 2 faces with two corners in one point"),
                                        HasSubstr("dropped 2 faces with the corners of an earlier one")));
}

TEST(Repair, ASurfaceSeenFromBothSidesIsTakenOnce) {
  const FileSurface ball = file_of(icosphere(0.05, 3));
  const Repaired result = repair(soup_of(together(turned(ball), ball)));
  EXPECT_EQ(result.mesh.face_count(), 180);
  EXPECT_GT(result.mesh.signed_volume(), 0);
}

TEST(Repair, OrientsFaces) {
  FileSurface surface = file_of(icosphere(0.05, 3));
  for (const std::size_t f : {3, 4, 50, 100, 101, 102, 170}) {
    std::swap(surface.triangles[f][0], surface.triangles[f][1]);
  }
  const Repaired result = repair(surface);
  EXPECT_NEAR(result.mesh.signed_volume(), 4.0 / 3.0 * std::numbers::pi * 1.25e-4, kRounding);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("turned 7 faces")));
}

TEST(Repair, TurnsABodyOutwards) {
  const Repaired result = repair(turned(file_of(cube())));
  EXPECT_NEAR(result.mesh.signed_volume(), 1e-6, kRounding);
  EXPECT_THAT(result.steps, ElementsAre("turned 1 piece outwards"));
}

TEST(Repair, TurnsOnlyThePieceThatNeedsIt) {
  const Repaired result = repair(together(turned(file_of(cube())), file_of(cube({0.02, 0, 0}))));
  EXPECT_NEAR(result.mesh.signed_volume(), 2e-6, kRounding);
  EXPECT_THAT(result.steps, ElementsAre("turned 1 piece outwards"));
}

TEST(Repair, FillsASmallHole) {
  const TriangleMesh ball = icosphere(0.05, 12);
  const Repaired result = repair(without_face(file_of(ball), 100));
  EXPECT_EQ(result.mesh.face_count(), ball.face_count());
  EXPECT_NEAR(result.mesh.signed_volume(), ball.signed_volume(), kRounding);  // the very face comes back
  EXPECT_THAT(result.steps, ElementsAre(AllOf(HasSubstr("filled 1 hole, of 3 edges, "), HasSubstr("mm round, near"))));
}

TEST(Repair, AHoleAboveTheLimitIsAnErrorWithPlaceAndLength) {
  FileSurface surface = file_of(cube());
  surface.triangles.erase(surface.triangles.begin() + 2, surface.triangles.begin() + 4);  // the side z = 10 mm
  EXPECT_THAT(refusal(surface),
              AllOf(HasSubstr("4 edges, 40.00 mm round, near (5.00, 5.00, 10.00) mm"), HasSubstr("limit of 1.73 mm")));
  RepairOptions lenient;
  lenient.hole = 0.041;
  const Repaired result = repair(surface, lenient);
  EXPECT_NEAR(result.mesh.signed_volume(), 1e-6, kRounding);
}

TEST(Repair, ACrackBesideALongEdgeIsClosed) {
  // A corner in the middle of an edge that only one side's faces know: the crack has no area, nor would its filling.
  FileSurface surface = file_of(cube());
  surface.points.emplace_back(0.005, 0.005, 0.01);  // on the diagonal 4-7 of faces (4 5 7) and (4 7 6)
  surface.triangles[2] = {4, 5, 8};
  surface.triangles.push_back({5, 7, 8});
  RepairOptions lenient;
  lenient.hole = 0.03;  // 14.14 mm there and as much back
  const Repaired result = repair(surface, lenient);
  EXPECT_NEAR(result.mesh.signed_volume(), 1e-6, kRounding);
  EXPECT_EQ(result.mesh.vertex_count(), 9);
  EXPECT_EQ(result.mesh.face_count(), 14);
}

/// The cube with a corner more on an edge's middle, and the face without area that closes the crack there.
FileSurface cube_with_a_flat_face() {
  FileSurface surface = file_of(cube());
  surface.points.emplace_back(0.005, 0.005, 0.01);
  surface.triangles[2] = {4, 5, 8};
  surface.triangles.push_back({5, 7, 8});
  surface.triangles.push_back({4, 8, 7});
  return surface;
}

TEST(Repair, FlipsAFaceOfThreePointsOnALine) {
  const Repaired result = repair(cube_with_a_flat_face());
  EXPECT_EQ(result.mesh.face_count(), 14);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("removed 1 face with next to no area")));
}

TEST(Repair, AHoleInWhatIsCutOffIsFilledHoweverLong) {
  FileSurface surface = file_of(cube());
  surface.triangles.erase(surface.triangles.begin() + 2, surface.triangles.begin() + 4);  // the side z = 10 mm
  RepairOptions options;
  options.unwanted = [](const Vector3& x) { return x.z() > 0.009; };
  EXPECT_NEAR(repair(surface, options).mesh.signed_volume(), 1e-6, kRounding);
  options.unwanted = [](const Vector3& x) { return x.x() > 0.005; };  // half of the hole only
  EXPECT_THAT(refusal(surface, options), AllOf(HasSubstr("--hole-mm"), HasSubstr("--resurface")));
}

TEST(ClosedMesh, LeavesAGoodMeshAsItIs) {
  const TriangleMesh ball = icosphere(0.05, 4);
  const Repaired result = closed_mesh(soup_of(file_of(ball)), 1.0, "skin.stl");
  EXPECT_THAT(result.steps, IsEmpty());
  EXPECT_EQ(result.mesh.face_count(), ball.face_count());
  EXPECT_EQ(closed_mesh(file_of(ball), 1.0, "skin.stl").mesh.vertices(), ball.vertices());
}

TEST(ClosedMesh, HasNoFacesWithoutArea) {
  // Three points on a line, in a row of three such faces, and a needle.
  FileSurface row = file_of(cube());
  const std::int64_t first = 8;
  for (int i = 1; i <= 3; ++i) {
    row.points.emplace_back(0.01 * i / 4.0, 0.01 * i / 4.0, 0.01);
  }
  row.triangles[2] = {4, 5, first};
  row.triangles.insert(row.triangles.end(), {{first, 5, first + 1},
                                             {first + 1, 5, first + 2},
                                             {first + 2, 5, 7},
                                             {4, first, first + 1},
                                             {4, first + 1, first + 2},
                                             {4, first + 2, 7}});
  FileSurface needle = file_of(cube());
  needle.points.emplace_back(1e-14, 0.0, 0.01);  // beside corner 4 on the edge 4-5
  needle.triangles[2] = {8, 5, 7};
  needle.triangles.push_back({4, 8, 7});
  needle.triangles[5] = {0, 5, 8};
  needle.triangles.push_back({0, 8, 4});
  FileSurface twice = file_of(cube());
  twice.triangles.push_back({0, 0, 3});
  for (const FileSurface& surface : {cube_with_a_flat_face(), row, needle, twice}) {
    const Repaired result = closed_mesh(surface, 1.0, "skin.stl");
    EXPECT_THAT(inspect(result.mesh).faults, IsEmpty());
    EXPECT_NEAR(result.mesh.signed_volume(), 1e-6, 1e-12);
    EXPECT_NEAR(result.mesh.total_area(), 6e-4, 1e-10);
    EXPECT_THAT(result.steps, ElementsAre(HasSubstr("face")));
  }
}

TEST(ClosedMesh, RefusesWhatIsNotClosedAndSaysWhatToTry) {
  const auto said = [](const FileSurface& surface) {
    return support::message_of<InputError>([&] { closed_mesh(surface, 1.0, "skin.stl"); });
  };
  const std::string remedy = "; try touchfield mesh skin.stl --repair -o fixed.obj";
  EXPECT_THAT(said(without_face(file_of(cube()), 3)),
              AllOf(HasSubstr("3 boundary edges"), ::testing::EndsWith(remedy)));
  EXPECT_THAT(said(turned(file_of(cube()))), AllOf(HasSubstr("inside out"), ::testing::EndsWith(remedy)));
  FileSurface flat;
  flat.points = {{0, 0, 0}, {1, 0, 0}};
  flat.triangles = {{0, 1, 1}};
  EXPECT_THAT(said(flat), HasSubstr("no face has an area"));
}

TEST(Repair, DropsStrayPieces) {
  const FileSurface body = file_of(icosphere(0.05, 4));
  const FileSurface crumb = file_of(transformed(icosphere(0.002, 1), Eigen::Matrix3d::Identity(), {0.1, 0, 0}));
  FileSurface scrap;
  scrap.points = {Vector3(0.2, 0, 0), Vector3(0.201, 0, 0), Vector3(0.2, 0.001, 0)};
  scrap.triangles = {{0, 1, 2}};
  const Repaired result = repair(together(together(crumb, body), scrap));
  EXPECT_EQ(result.mesh.face_count(), 320);
  EXPECT_THAT(result.steps,
              ElementsAre(AllOf(HasSubstr("dropped 2 stray pieces (21 faces"), HasSubstr("first at (100."))));

  RepairOptions keep;
  keep.stray = 0.0;
  keep.hole = 1e-3;  // the scrap's rim is 3.4 mm
  EXPECT_THAT(refusal(together(together(crumb, body), scrap), keep), HasSubstr("a hole of 3 edges"));
  EXPECT_EQ(repair(together(crumb, body), keep).mesh.face_count(), 340);
}

TEST(Repair, DropsASurfaceInsideAnother) {
  const FileSurface outer = file_of(icosphere(0.05, 4));
  for (const FileSurface& inner : {file_of(icosphere(0.02, 2)), turned(file_of(icosphere(0.02, 2)))}) {
    for (const FileSurface& pair : {together(outer, inner), together(inner, outer)}) {
      const Repaired result = repair(pair);
      EXPECT_EQ(result.mesh.face_count(), 320);
      EXPECT_THAT(result.steps.back(), HasSubstr("dropped 1 piece inside another, where no sound comes (80 faces, "));
    }
  }
}

// Three bars stick out of a ball that holds a crumb: the crumb is dropped, said with its area, the bars are not.
TEST(Repair, DropsNoPartThatOverlapsAnother) {
  FileSurface surface = file_of(icosphere(0.03, 8));
  for (int i = 0; i < 3; ++i) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0 + i, Vector3::UnitZ()).toRotationMatrix();
    surface = together(
        surface, file_of(transformed(box({0.012, 0.06, 0.012}, 4e-3).mesh, turn, turn * Vector3(0, 0.04, 0.001))));
  }
  surface = together(surface, file_of(icosphere(0.005, 2)));
  EXPECT_THAT(refusal(surface), HasSubstr("faces intersect"));
  const Repaired lone = repair(together(file_of(icosphere(0.03, 8)), file_of(icosphere(0.005, 2))));
  // 4 pi r^2 = 314 mm2, a little more for 80 flat faces round the same volume.
  EXPECT_THAT(lone.steps,
              ElementsAre(AllOf(HasSubstr("dropped 1 piece inside another"), HasSubstr("(80 faces, 319 mm2)"))));
}

/// An icosphere with a triangle of a tenth of a micrometre to 1 um in the middle of a face, joined to its corners.
FileSurface finely_dented() {
  FileSurface surface = file_of(icosphere(0.05, 4));
  const auto outer = surface.triangles[7];
  const auto corner = [&](std::size_t c) { return surface.points[static_cast<std::size_t>(outer[c])]; };
  const Vector3 middle = (corner(0) + corner(1) + corner(2)) / 3.0;
  const auto first = static_cast<std::int64_t>(surface.points.size());
  for (std::size_t c = 0; c < 3; ++c) {
    surface.points.push_back(middle + 1e-4 * (corner(c) - middle));
  }
  surface.triangles[7] = {first, first + 1, first + 2};
  for (std::int64_t c = 0; c < 3; ++c) {
    const std::int64_t next = (c + 1) % 3;
    const auto at = [&](std::int64_t i) { return outer[static_cast<std::size_t>(i)]; };
    surface.triangles.push_back({at(c), at(next), first + next});
    surface.triangles.push_back({at(c), first + next, first + c});
  }
  return surface;
}

TEST(Repair, FineEdgesOfAFaultlessSurfaceStay) {
  const FileSurface surface = finely_dented();
  const Repaired result = repair(soup_of(surface));
  EXPECT_EQ(result.mesh.vertex_count(), 165);
  EXPECT_EQ(result.mesh.face_count(), 326);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("in the same place")));
}

TEST(Repair, FineEdgesStayWhereSomethingElseIsRepaired) {
  RepairOptions lenient;
  lenient.hole = 0.05;  // 45 mm round
  const Repaired result = repair(without_face(finely_dented(), 100), lenient);
  EXPECT_EQ(result.mesh.vertex_count(), 165);
  EXPECT_EQ(result.mesh.face_count(), 326);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("filled 1 hole, of 3 edges")));
}

TEST(Repair, DropsFlaps) {
  FileSurface surface = file_of(icosphere(0.05, 4));
  surface.points.push_back(surface.points[static_cast<std::size_t>(surface.triangles[7][0])] * 1.05);
  const auto tip = static_cast<std::int64_t>(surface.points.size()) - 1;
  surface.triangles.push_back({surface.triangles[7][0], surface.triangles[7][1], tip});
  const Repaired result = repair(surface);
  EXPECT_EQ(result.mesh.face_count(), 320);
  EXPECT_EQ(result.mesh.vertex_count(), 162);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("dropped flaps of 1 face ")));
}

TEST(Repair, JoinsBodiesThatShareAWall) {
  // Two cubes side by side, each with its own wall between them: the walls are one another's copies the other way.
  TriangleMesh mirrored = cube();
  Points vertices = mirrored.vertices();
  vertices.row(0) *= -1.0;
  const FileSurface left = turned(file_of(TriangleMesh(vertices, mirrored.triangles())));
  const Repaired result = repair(together(file_of(cube()), left));
  EXPECT_NEAR(result.mesh.signed_volume(), 2e-6, kRounding);
  EXPECT_EQ(result.mesh.face_count(), 20);
}

TEST(Repair, SplitsAPointInWhichBodiesTouch) {
  FileSurface surface = together(file_of(cube()), file_of(cube({0.01, 0.01, 0.01})));
  const Repaired result = repair(surface);
  EXPECT_EQ(result.mesh.vertex_count(), 16);
  EXPECT_EQ(result.mesh.face_count(), 24);
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("welded 1 point to"),
                                        AllOf(HasSubstr("split 1 point "), HasSubstr("(10.00, 10.00, 10.00)"))));
  // A hundredth of the edge of 10 mm each, apart for good.
  double nearest = 1.0;
  for (Eigen::Index i = 0; i < 16; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      nearest = std::min(nearest, (result.mesh.vertices().col(i) - result.mesh.vertices().col(j)).norm());
    }
  }
  EXPECT_GT(nearest, 0.5e-4);
  EXPECT_LT(nearest, 2.1e-4);
  EXPECT_NEAR(result.mesh.signed_volume(), 2e-6, 2e-8);
}

TEST(Repair, CutsOutAFewFacesThatCutEachOther) {
  const TriangleMesh ball = icosphere(0.05, 20);
  FileSurface surface = file_of(ball);
  // A point pulled along the skin to 9 mm away, just above it: from below the horizon its faces come up through the
  // skin.
  const auto away = [&](const Vector3& x) { return std::abs((x - ball.vertices().col(700)).norm() - 9e-3); };
  const Vector3 there = *std::min_element(surface.points.begin(), surface.points.end(),
                                          [&](const Vector3& x, const Vector3& y) { return away(x) < away(y); });
  surface.points[700] = 1.003 * there;
  ASSERT_GT(inspect_surface(surface, 1.0).skin.crossings, 0);
  const Repaired result = repair(surface);
  EXPECT_NEAR(result.mesh.signed_volume(), ball.signed_volume(), 0.01 * ball.signed_volume());
  EXPECT_THAT(result.steps, ElementsAre(HasSubstr("cut out the surroundings of")));
}

TEST(Repair, BodiesThatGoThroughEachOtherAreAnError) {
  EXPECT_THAT(refusal(together(file_of(cube()), file_of(cube({0.005, 0.004, 0.003})))),
              AllOf(HasSubstr("faces intersect"), HasSubstr("the first near (")));
}

// A finger in a ball: cutting round the seam would leave a stump and drop the rest unsaid.
TEST(Repair, ABodyThatWouldFallApartIsAnError) {
  const FileSurface ball = file_of(icosphere(0.05, 24));
  const FileSurface finger =
      file_of(transformed(capsule(0.004, 0.03, 1.5e-3).mesh, Eigen::Matrix3d::Identity(), {0, 0.05, 0}));
  EXPECT_THAT(refusal(together(ball, finger)), HasSubstr("faces intersect"));
}

// The torus of seven points, each joined to every other, without one of them: all diagonals of the hole are taken.
TEST(FillSmallHoles, TakesAPointMoreWhereEveryDiagonalIsTaken) {
  RawSurface surface{Points(3, 7), Triangles(3, 8)};
  for (int i = 0; i < 7; ++i) {
    const double round = 2.0 * std::numbers::pi * i / 7.0;
    surface.points.col(i) = Vector3(std::cos(round), std::sin(round), 0.3 * std::cos(3.0 * round));
  }
  Eigen::Index count = 0;
  for (int i = 0; i < 7; ++i) {
    for (const Eigen::Vector3i& step : {Eigen::Vector3i(0, 1, 3), Eigen::Vector3i(0, 3, 2)}) {
      const Eigen::Vector3i face = (step.array() + i).unaryExpr([](int v) { return v % 7; });
      if ((face.array() != 6).all()) {
        surface.triangles.col(count++) = face;
      }
    }
  }
  ASSERT_EQ(count, 8);  // each point has six faces of the fourteen
  StepLog log;
  EXPECT_THAT(fill_small_holes(surface, 100.0, log), IsEmpty());
  EXPECT_EQ(surface.points.cols(), 8);
  EXPECT_EQ(surface.triangles.cols(), 14);
  const MeshReport report = inspect(surface.points, surface.triangles);
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.misoriented_edges, 0);
  EXPECT_EQ(report.nonmanifold_vertices, 0);
}

TEST(Repair, AMoebiusStripIsAnError) {
  EXPECT_THAT(refusal(band(24, true)),
              AllOf(HasSubstr("not orientable"), HasSubstr("misoriented edge"), HasSubstr("mm")));
  // The band itself is no fault: without its twist only the holes are.
  EXPECT_THAT(refusal(band(24, false)), AllOf(HasSubstr("hole of 24 edges"), Not(HasSubstr("orientable"))));
}

TEST(Repair, AnEdgeOfFourFacesIsAnError) {
  EXPECT_THAT(refusal(together(file_of(cube()), file_of(cube({0.01, 0.01, 0})))),
              AllOf(HasSubstr("1 non-manifold edge"), HasSubstr("(10.00, 10.00, 5.00) mm")));
}

TEST(Repair, NothingLeftIsAnError) {
  FileSurface surface;
  surface.points = {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};
  EXPECT_THAT(refusal(surface), HasSubstr("no face is left"));
  surface.triangles = {{1, 1, 1}, {1, 1, 1}};
  EXPECT_THAT(refusal(surface), HasSubstr("no face is left"));
  surface.triangles = {{0, 1, 2}};
  EXPECT_THAT(refusal(surface), HasSubstr("a hole of 3 edges"));
  RepairOptions lenient;
  lenient.hole = 10.0;
  EXPECT_THAT(refusal(surface, lenient), HasSubstr("without volume"));
  surface.points[2] = Vector3(2, 0, 0);
  EXPECT_THAT(refusal(surface, lenient), HasSubstr("no face has an area"));
}

TEST(Repair, NumbersThatAreNone) {
  FileSurface surface = file_of(cube());
  surface.points[5].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(support::message_of<InputError>([&] { repaired(surface, 1.0, {}, "skin.stl"); }), HasSubstr("point 5"));
  surface = file_of(cube());
  surface.triangles[3][1] = 8;
  EXPECT_THAT(support::message_of<InputError>([&] { repaired(surface, 1.0, {}, "skin.stl"); }), HasSubstr("face 3"));
  RepairOptions options;
  options.weld = -1.0;
  EXPECT_THROW(repaired(file_of(cube()), 1.0, options, "skin.stl"), InputError);
  options = {};
  options.hole = std::numeric_limits<double>::infinity();
  EXPECT_THROW(repaired(file_of(cube()), 1.0, options, "skin.stl"), InputError);
  options = {};
  options.stray = 1.5;
  EXPECT_THROW(repaired(file_of(cube()), 1.0, options, "skin.stl"), InputError);
}

// Whatever faces there are: a mesh without fault comes out, or a clear error.
TEST(Repair, AnyFacesGiveAMeshOrAnError) {
  std::mt19937_64 random(7);
  int repaired_count = 0;
  int refused_count = 0;
  for (int trial = 0; trial < 300; ++trial) {
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
    RepairOptions options;
    options.hole = 0.1;
    try {
      const Repaired result = repaired(surface, 1.0, options, "skin.stl");
      EXPECT_THAT(inspect_skin(result.mesh.vertices(), result.mesh.triangles()).faults, IsEmpty()) << trial;
      ++repaired_count;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), StartsWith("skin.stl: the mesh cannot be repaired: ")) << trial;
      ++refused_count;
    }
  }
  EXPECT_GT(repaired_count, 50);
  EXPECT_GT(refused_count, 20);
}

}  // namespace
}  // namespace touchfield
