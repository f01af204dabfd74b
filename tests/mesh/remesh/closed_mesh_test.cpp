#include "sim/mesh/remesh/closed_mesh.h"

#include <string>
#include <utility>
#include <vector>

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
  FileSurface needle = file_of(cube());
  needle.points.emplace_back(1e-14, 0.0, 0.01);  // beside corner 4 on the edge 4-5
  needle.triangles[2] = {8, 5, 7};
  needle.triangles.push_back({4, 8, 7});
  needle.triangles[5] = {0, 5, 8};
  needle.triangles.push_back({0, 8, 4});
  FileSurface twice = file_of(cube());
  twice.triangles.push_back({0, 0, 3});
  for (const FileSurface& surface : {cube_with_a_flat_face(), needle, twice}) {
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

/// Share of the area that looks outwards, on a surface whose faces' order nothing keeps: by the faces' centroids.
double outward_share(const TriangleMesh& soup, const TriangleMesh& mesh) {
  double outward = 0;
  for (Eigen::Index f = 0; f < soup.face_count(); ++f) {
    Eigen::Index nearest = 0;
    (mesh.centroids().colwise() - Vector3(soup.centroids().col(f))).colwise().squaredNorm().minCoeff(&nearest);
    outward += soup.normals().col(f).dot(mesh.normals().col(nearest)) > 0 ? soup.areas()(f) : 0.0;
  }
  return outward / soup.total_area();
}

TEST(OrientedSoup, TurnsFacesAndPieces) {
  const TriangleMesh ball = icosphere(10e-3, 6);
  FileSurface flipped = turned(file_of(ball));
  for (std::size_t f = 0; f < flipped.triangles.size(); f += 3) {
    std::swap(flipped.triangles[f][0], flipped.triangles[f][1]);
  }
  const OrientedSoup soup = oriented_soup(flipped, 1.0, "skin.stl");
  EXPECT_NEAR(soup.mesh.signed_volume(), ball.signed_volume(), 1e-9 * ball.signed_volume());
  EXPECT_THAT(soup.steps, Contains("turned 1 patch outwards"));
}

TEST(OrientedSoup, AnOpenBowlBulgesOutwards) {
  const TriangleMesh ball = icosphere(10e-3, 10);
  std::vector<int> part;
  for (Eigen::Index f = 0; f < ball.face_count(); ++f) {
    if (ball.centroids()(2, f) > -5e-3) {
      part.push_back(static_cast<int>(f));
    }
  }
  const TriangleMesh bowl(ball.vertices(), ball.triangles()(Eigen::all, part));
  for (const FileSurface& surface : {file_of(bowl), turned(file_of(bowl))}) {
    EXPECT_NEAR(outward_share(oriented_soup(surface, 1.0, "skin.stl").mesh, ball), 1.0, 1e-12);
  }
}

// The box takes up more of the space about the ball than of that in it, which is no reason to turn the ball.
TEST(OrientedSoup, ABallWithAHoleLooksOutwardsBesideALargeBox) {
  const TriangleMesh ball = icosphere(8e-3, 8);
  const TriangleMesh block = box({80e-3, 80e-3, 80e-3}, 10e-3).mesh;
  for (const double apart : {-2e-3, 1e-3}) {
    const Points beside =
        block.vertices().colwise() + Vector3(0, 0, -8e-3 - apart - block.vertices().row(2).maxCoeff());
    const FileSurface all = together(file_of(TriangleMesh(beside, block.triangles())), without_face(file_of(ball), 5));
    for (const FileSurface& surface : {all, turned(all)}) {
      EXPECT_NEAR(oriented_soup(surface, 1.0, "skin.stl").mesh.signed_volume() - block.signed_volume(),
                  ball.signed_volume(), 0.01 * ball.signed_volume());
    }
  }
}

}  // namespace touchfield::closed_mesh_test
