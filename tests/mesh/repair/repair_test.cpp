#include "sim/mesh/repair/repair.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "sim/body/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/repair/repair_steps.h"
#include "sim/mesh/repair/surface_report.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"

namespace touchfield::repair_test {

constexpr double kRounding = 1e-14;

Repaired repair(const FileSurface& surface, const RepairOptions& options = {}) {
  Repaired result = repaired(surface, 1.0, options, "skin.stl");
  EXPECT_THAT(inspect_skin(result.mesh.vertices(), result.mesh.triangles()).faults, IsEmpty());
  return result;
}

std::string refusal(const FileSurface& surface, const RepairOptions& options = {}) {
  const std::string message = message_of<InputError>([&] { repaired(surface, 1.0, options, "skin.stl"); });
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
    return message_of<InputError>([&] { closed_mesh(surface, 1.0, "skin.stl"); });
  };
  const std::string remedy = "; try touchfield mesh skin.stl --repair -o fixed.obj";
  EXPECT_THAT(said(without_face(file_of(cube()), 3)), AllOf(HasSubstr("3 boundary edges"), EndsWith(remedy)));
  EXPECT_THAT(said(turned(file_of(cube()))), AllOf(HasSubstr("inside out"), EndsWith(remedy)));
  FileSurface flat;
  flat.points = {{0, 0, 0}, {1, 0, 0}};
  flat.triangles = {{0, 1, 1}};
  EXPECT_THAT(said(flat), HasSubstr("no face has an area"));
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
}

TEST(Repair, SaysTheAreaOfWhatIsDropped) {
  const Repaired lone = repair(together(file_of(icosphere(0.03, 8)), file_of(icosphere(0.005, 2))));
  // 4 pi r^2 = 314 mm2, a little more for 80 flat faces round the same volume.
  EXPECT_THAT(lone.steps,
              ElementsAre(AllOf(HasSubstr("dropped 1 piece inside another"), HasSubstr("(80 faces, 319 mm2)"))));
}

/// A body whose faces cannot stay, and the volume of the skin that becomes of it.
struct Faulty {
  const char* fault;  // as the report names it
  FileSurface surface;
  double volume;  // [m3]
};

/// What faces that stay cannot mend: holes, flaps, walls between bodies, touching and crossing bodies.
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

TEST(Repair, ReplacesAllFacesWhereTheyCannotStay) {
  for (const Faulty& body : faulty()) {
    SCOPED_TRACE(body.fault);
    const Repaired result = repair(body.surface);
    EXPECT_THAT(result.steps.front(), AllOf(StartsWith("all faces are replaced because of these faults: "),
                                            HasSubstr(body.fault), HasSubstr(" mm")));
    // Edges of a 64th of the body's size round off what is sharp.
    EXPECT_NEAR(result.mesh.signed_volume(), body.volume, 0.01 * body.volume);
    ASSERT_TRUE(result.to_skin && result.from_skin);
    EXPECT_LT(result.to_skin->most_of_it, 0.05 * std::cbrt(body.volume));
  }
}

TEST(Repair, TakesTheEdgeOfNewFaces) {
  const FileSurface open = without_face(file_of(icosphere(0.05, 8)), 100);
  EXPECT_NEAR(repair(open, {true, 4e-3}).mesh.mean_edge(), 4e-3, 2e-4);
  // A 64th of 100 mm.
  EXPECT_NEAR(repair(open).mesh.mean_edge(), 0.1 / 64, 1e-4);
  const FileSurface whole = file_of(icosphere(0.05, 8));
  EXPECT_EQ(repair(whole, {true, 4e-3}).mesh.face_count(), 1280);
  EXPECT_NEAR(repair(whole, {false, 4e-3}).mesh.mean_edge(), 4e-3, 2e-4);
}

TEST(Repair, StrayPiecesAreDroppedFromANewSkinToo) {
  const FileSurface body = without_face(file_of(icosphere(0.05, 8)), 100);
  const FileSurface crumb = file_of(transformed(icosphere(0.004, 2), Eigen::Matrix3d::Identity(), {0.1, 0, 0}));
  const Repaired result = repair(together(body, crumb));
  EXPECT_EQ(inspect(result.mesh).components, 1);
  EXPECT_THAT(result.steps.back(), HasSubstr("dropped 1 stray piece ("));
}

TEST(Repair, RefusesWhatHasNoVolume) {
  EXPECT_THAT(refusal(band(24, true)),
              AllOf(HasSubstr("not orientable"), HasSubstr("misoriented edge"), HasSubstr("mm")));
  FileSurface surface;
  surface.points = {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};
  surface.triangles = {{1, 1, 1}, {1, 1, 1}};
  EXPECT_THAT(refusal(surface), HasSubstr("no face has an area"));
  surface.triangles = {{0, 1, 2}};
  EXPECT_THAT(refusal(surface), HasSubstr("no volume"));
}

// Whatever faces there are: a mesh without fault comes out, or a clear error.
TEST(Repair, AnyFacesGiveAMeshOrAnError) {
  std::mt19937_64 random(7);
  int kept = 0;
  int replaced = 0;
  for (int trial = 0; trial < 60; ++trial) {
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
      const Repaired result = repaired(surface, 1.0, {true, 5e-3}, "skin.stl");
      EXPECT_THAT(inspect_skin(result.mesh.vertices(), result.mesh.triangles()).faults, IsEmpty()) << trial;
      ++(result.to_skin ? replaced : kept);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), StartsWith("skin.stl: ")) << trial;
    }
  }
  EXPECT_GT(kept, 5);
  EXPECT_GT(replaced, 30);
}

}  // namespace touchfield::repair_test
