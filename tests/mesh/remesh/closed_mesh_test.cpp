#include "sim/mesh/remesh/closed_mesh.h"

#include <array>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "sim/hand/hand.h"
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

/// The mesh cut into patches with points of their own, every second one turned on the whole.
FileSurface cut_and_turned(const TriangleMesh& mesh, const std::vector<std::size_t>& patch_of, std::size_t patches) {
  std::mt19937_64 random(4);
  std::vector<FileSurface> parts(patches);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    FileSurface& part = parts[patch_of[static_cast<std::size_t>(f)]];
    const auto first = static_cast<std::int64_t>(part.points.size());
    for (int c = 0; c < 3; ++c) {
      part.points.emplace_back(mesh.corner(f, c));
    }
    part.triangles.push_back({first, first + 1, first + 2});
  }
  FileSurface all;
  for (std::size_t p = 0; p < patches; ++p) {
    const Vector3 off = 1e-7 * static_cast<double>(p + 1) * Vector3(1, -1, 1);  // that no edge has two patches
    for (Vector3& x : parts[p].points) {
      x += off;
    }
    all = together(all, random() % 2 == 0 ? turned(parts[p]) : parts[p]);
  }
  return all;
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

// A lid that is nearly flat says nothing of itself; the bowl it closes does.
TEST(OrientedSoup, ALidLooksAwayFromItsBowl) {
  const TriangleMesh block = box({20e-3, 20e-3, 20e-3}, 4e-3).mesh;
  std::vector<std::size_t> patch_of;
  for (Eigen::Index f = 0; f < block.face_count(); ++f) {
    patch_of.push_back(block.normals()(2, f) > 0.5 ? 1 : 0);
  }
  EXPECT_NEAR(outward_share(oriented_soup(cut_and_turned(block, patch_of, 2), 1.0, "skin.stl").mesh, block), 1.0,
              1e-12);
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

TEST(OrientedSoup, PatchesOfAHandLookOutwards) {
  const TriangleMesh skin = hand({.pose = "flat", .edge = 4e-3}).mesh;
  constexpr std::size_t kPatches = 30;
  std::mt19937_64 random(9);
  std::vector<Vector3> seeds = {skin.centroids().col(0)};
  while (seeds.size() < kPatches) {
    seeds.emplace_back(
        skin.centroids().col(static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(skin.face_count()))));
  }
  std::vector<std::size_t> patch_of;
  for (Eigen::Index f = 0; f < skin.face_count(); ++f) {
    std::size_t nearest = 0;
    for (std::size_t p = 1; p < kPatches; ++p) {
      const Vector3 x = skin.centroids().col(f);
      nearest = (seeds[p] - x).norm() < (seeds[nearest] - x).norm() ? p : nearest;
    }
    patch_of.push_back(nearest);
  }
  EXPECT_GT(outward_share(oriented_soup(cut_and_turned(skin, patch_of, kPatches), 1.0, "skin.stl").mesh, skin), 0.9);
}

}  // namespace touchfield::closed_mesh_test
