#include "sim/mesh/remesh/closed_mesh.h"

#include <string>

#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"

namespace touchfield::closed_mesh_test {

/// The cube with a corner more on an edge's middle, and the face without area that closes the crack there.
FileSurface cube_with_a_flat_face() {
  FileSurface surface = file_of(cube());
  surface.points.emplace_back(0.005, 0.005, 0.01);
  surface.triangles[2] = {4, 5, 8};
  surface.triangles.push_back({5, 7, 8});
  surface.triangles.push_back({4, 8, 7});
  return surface;
}

TEST(ClosedMesh, LeavesAGoodMeshAsItIs) {
  const TriangleMesh ball = icosphere(0.05, 4);
  const ClosedMesh result = closed_mesh(soup_of(file_of(ball)), 1.0, "skin.stl");
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
    const ClosedMesh result = closed_mesh(surface, 1.0, "skin.stl");
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
  const std::string remedy =
      "; try touchfield mesh skin.stl --resurface MM -o fixed.obj with MM the length of its new edges";
  EXPECT_THAT(said(without_face(file_of(cube()), 3)), AllOf(HasSubstr("3 boundary edges"), EndsWith(remedy)));
  EXPECT_THAT(said(turned(file_of(cube()))), AllOf(HasSubstr("inside out"), EndsWith(remedy)));
  FileSurface flat;
  flat.points = {{0, 0, 0}, {1, 0, 0}};
  flat.triangles = {{0, 1, 1}};
  EXPECT_THAT(said(flat), HasSubstr("no face has an area"));
}

}  // namespace touchfield::closed_mesh_test
