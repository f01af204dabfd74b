#include "sim/mesh/query/inspect.h"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "sim/hand/shapes.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "tests/support/mesh_support.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"

namespace touchfield::inspect_test {

TriangleMesh with_triangles(const TriangleMesh& mesh, const Triangles& triangles) {
  return {mesh.vertices(), triangles};
}

/// Vertex `gone` replaced by `kept` in all faces of the mesh.
TriangleMesh with_vertices_joined(const TriangleMesh& mesh, int kept, int gone) {
  return with_triangles(mesh, (mesh.triangles().array() == gone).select(kept, mesh.triangles()));
}

TEST(Inspect, CubeIsClosedAndMeasured) {
  const MeshReport report = inspect(cube());
  EXPECT_EQ(report.faces, 12);
  EXPECT_EQ(report.vertices, 8);
  EXPECT_EQ(report.unused_vertices, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_TRUE(report.closed());
  EXPECT_FALSE(report.inside_out);
  EXPECT_THAT(report.faults, IsEmpty());
  constexpr double kRounding = 1e-14;
  EXPECT_NEAR(report.area, 6e-4, kRounding);
  EXPECT_NEAR(report.volume, 1e-6, kRounding);
  EXPECT_NEAR(report.shortest_edge, 0.01, kRounding);
  EXPECT_NEAR(report.longest_edge, 0.01 * std::numbers::sqrt2, kRounding);
  EXPECT_NEAR(report.smallest_angle, std::numbers::pi / 4.0, kRounding);
  EXPECT_NO_THROW(require_closed_surface(cube(), "cube.stl"));
}

TEST(Inspect, FindsAHole) {
  const TriangleMesh open = with_triangles(cube(), cube().triangles().rightCols(11));  // without (0, 3, 1)
  const MeshReport report = inspect(open);
  EXPECT_EQ(report.boundary_edges, 3);
  EXPECT_FALSE(report.closed());
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(report.faults,
              ElementsAre("3 boundary edges (1 hole of 34.14 mm), the first between vertices 0 and 1 near "
                          "(5.00, 0.00, 0.00) mm"));
  ASSERT_EQ(report.holes.size(), 1u);
  EXPECT_EQ(report.holes[0].edges, 3);
  EXPECT_NEAR(report.holes[0].length, 0.02 + 0.01 * std::numbers::sqrt2, 1e-14);
  // Middles of the sides: (5, 5), (10, 5), (5, 0) mm.
  EXPECT_NEAR((report.holes[0].at - Vector3(0.02 / 3, 0.01 / 3, 0)).norm(), 0, 1e-14);
}

TEST(Inspect, FindsOtherFaults) {
  Triangles flipped = cube().triangles();
  std::swap(flipped(0, 5), flipped(1, 5));
  Triangles inwards = cube().triangles();
  inwards.row(0).swap(inwards.row(2));
  Triangles pillow(3, 2);
  pillow << 0, 0, 1, 2, 2, 1;
  // The edge from 1 to 5 of the first is that from 2 to 6 of the second (numbered from 8).
  const TriangleMesh at_edge =
      with_vertices_joined(with_vertices_joined(together(cube(), cube({0.01, -0.01, 0})), 1, 10), 5, 14);
  struct Case {
    TriangleMesh mesh;
    std::string fault;
    bool inside_out;
    int components;
  };
  for (const auto& [mesh, fault, inside_out, components] : std::vector<Case>{
           {with_triangles(cube(), flipped), "3 misoriented edges", false, 1},  // neither in nor out
           {at_edge, "1 non-manifold edge \\(.* vertices 1 and 5 .*\\(10.00, 0.00, 5.00\\) mm", false, 1},
           {with_vertices_joined(together(cube(), cube({0.01, 0.01, 0.01})), 7, 8),
            "1 non-manifold vertex.* vertex 7 at \\(10.00, 10.00, 10.00\\) mm", false, 2},
           // The volume of the whole is positive; that of the second piece is not.
           {together(icosphere(0.1, 2), with_triangles(cube({0.2, 0, 0}), inwards)), "1 piece inside out.* face 80",
            true, 2},
           {with_triangles(cube(), pillow), "1 piece without volume", false, 1},
       }) {
    const MeshReport report = inspect(mesh);
    EXPECT_THAT(report.faults, ElementsAre(ContainsRegex(fault)));
    EXPECT_EQ(report.boundary_edges, 0);
    EXPECT_EQ(report.inside_out, inside_out) << fault;
    EXPECT_EQ(report.components, components) << fault;
  }
}

TEST(Inspect, FindsASurfaceInsideAnother) {
  const TriangleMesh outer = icosphere(0.1, 2);
  const TriangleMesh inner = icosphere(0.05, 1);
  for (const TriangleMesh& mesh : {together(outer, inner), together(inner, outer)}) {
    const MeshReport report = inspect(mesh);
    EXPECT_EQ(report.nested_pieces, 1);
    EXPECT_FALSE(report.inside_out);
    EXPECT_THAT(report.faults, ElementsAre(HasSubstr("1 piece inside another")));
  }
  const MeshReport three = inspect(together(together(outer, inner), icosphere(0.01, 1)));
  EXPECT_EQ(three.nested_pieces, 2);
  // The inner surface of a shell looks inwards.
  Triangles inwards = inner.triangles();
  inwards.row(0).swap(inwards.row(1));
  const MeshReport shell = inspect(together(outer, with_triangles(inner, inwards)));
  EXPECT_EQ(shell.nested_pieces, 1);
  EXPECT_TRUE(shell.inside_out);
}

// Near, but outside: in the notch between two others' boxes, and one touching another.
TEST(Inspect, TakesBodiesBesideEachOther) {
  const TriangleMesh ball = icosphere(0.1, 3);
  const TriangleMesh crumb = shifted(icosphere(0.005, 1), {0.095, 0.095, 0.095});  // in the ball's box
  EXPECT_EQ(inspect(together(ball, crumb)).nested_pieces, 0);
  EXPECT_EQ(inspect(together(cube(), cube({0.01, 0, 0}))).nested_pieces, 0);
}

TEST(RequireClosedSurface, NamesTheMeshAndEveryFault) {
  Triangles triangles = cube().triangles();
  std::swap(triangles(0, 5), triangles(1, 5));
  const TriangleMesh broken = with_triangles(cube(), triangles.rightCols(11));
  EXPECT_THAT(
      [&] { require_closed_surface(broken, "hands/mine.stl"); },
      ThrowsMessage<InputError>(AllOf(HasSubstr("hands/mine.stl: "), HasSubstr("3 boundary edges (1 hole of 34.14 mm)"),
                                      HasSubstr("misoriented edge"))));
}

TEST(InspectSurface, CountsWhatIsWrongWithFaces) {
  FileSurface surface = file_of(cube());
  surface.points.emplace_back(1, 2, 3);
  surface.points.emplace_back(-0.0, 0.0, -0.0);                             // corner 0 again
  surface.points.push_back(0.5 * (surface.points[0] + surface.points[1]));  // on the edge 0-1
  surface.triangles.push_back({9, 0, 2});
  surface.triangles.push_back({5, 5, 5});
  surface.triangles.push_back({surface.triangles[4][2], surface.triangles[4][0], surface.triangles[4][1]});
  surface.triangles.push_back({surface.triangles[5][1], surface.triangles[5][0], surface.triangles[5][2]});
  surface.triangles.push_back({0, 10, 1});
  const SurfaceReport report = inspect_surface(surface, 1.0);
  EXPECT_EQ(report.points, 11);
  EXPECT_EQ(report.faces, 17);
  EXPECT_EQ(report.unreferenced_points, 1);
  EXPECT_EQ(report.repeated_points, 1);
  EXPECT_EQ(report.collapsed_faces, 2);
  EXPECT_EQ(report.duplicate_faces, 2);
  EXPECT_EQ(report.skin.flat_faces, 1);
  EXPECT_EQ(report.skin.mesh.boundary_edges, 2);
  EXPECT_EQ(report.skin.mesh.nonmanifold_edges, 1);
  EXPECT_THAT(report.skin.faults,
              ElementsAre(HasSubstr("2 faces have two corners in one point"),
                          HasSubstr("2 faces have the corners of an earlier one"), HasSubstr("1 face without area"),
                          HasSubstr("2 boundary edges"), HasSubstr("1 non-manifold edge")));
}

TEST(InspectSurface, NothingThereIsAFault) {
  FileSurface surface;
  EXPECT_THAT(inspect_surface(surface, 1.0).skin.faults, ElementsAre("no face has an area"));
  surface.points.assign(3, Vector3(1, 1, 1));
  surface.triangles = {{0, 1, 2}};
  EXPECT_THAT(inspect_surface(surface, 1.0).skin.faults,
              ElementsAre("1 face has two corners in one point", "no face has an area"));
  surface.points = {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(3, 0, 0)};
  EXPECT_THAT(inspect_surface(surface, 1.0).skin.faults, ElementsAre("no face has an area"));
}

using std::numbers::pi;

TEST(MeshRisks, FindTheThicknessOfAPlate) {
  const MeshRisks risks = mesh_risks(box({0.03, 0.03, 2e-3}, 2e-3).mesh);
  EXPECT_NEAR(risks.thickness, 1.0, 0.15);
  EXPECT_NEAR(risks.thickness_at.z(), 0.0, 1e-12);
  EXPECT_TRUE(std::isinf(risks.gap));
}

/// An octahedron of legs 10 mm with one leg of another length.
TriangleMesh octahedron(double top) {
  Points vertices(3, 6);
  vertices << 1, -1, 0, 0, 0, 0,  //
      0, 0, 1, -1, 0, 0,          //
      0, 0, 0, 0, top, -1;
  Triangles triangles(3, 8);
  triangles << 0, 2, 1, 3, 2, 1, 3, 0,  //
      2, 1, 3, 0, 0, 2, 1, 3,           //
      4, 4, 4, 4, 5, 5, 5, 5;
  return {0.01 * vertices, triangles};
}

// A face has area 1/2 sqrt(a^2 b^2 + b^2 c^2 + c^2 a^2) of its legs.
TEST(MeshRisks, FindTheJumpOfSizesAndTheSmallestAngle) {
  const double top = 4.0;
  const MeshRisks risks = mesh_risks(octahedron(top));
  EXPECT_NEAR(risks.size_jump, std::pow((1 + 2 * top * top) / 3.0, 0.25), 1e-12);
  EXPECT_NEAR(risks.jump_at.z(), 0.0, 1e-15);
  EXPECT_NEAR(risks.jump_at.norm(), 0.01 * std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(risks.size_range, std::sqrt((1 + top * top) / 2.0), 1e-12);
  EXPECT_NEAR(risks.smallest_angle, 2.0 * std::asin(std::sqrt(0.5) / std::sqrt(1 + top * top)), 1e-12);
  EXPECT_LT((risks.angle_at - Vector3(0, 0, 0.01 * top)).norm(), 1e-15);

  const MeshRisks regular = mesh_risks(octahedron(1.0));
  EXPECT_NEAR(regular.size_jump, 1.0, 1e-12);
  EXPECT_NEAR(regular.size_range, 1.0, 1e-12);
  EXPECT_NEAR(regular.smallest_angle, pi / 3.0, 1e-12);
}

// What is counted over the larger edge does not depend on which of the faces is asked.
TEST(MeshRisks, CountTheGapByTheLargerEdge) {
  const double gap = 1e-3;
  const TriangleMesh coarse = box({0.02, 0.02, 0.02}, 4e-3).mesh;
  const TriangleMesh fine = shifted(box({0.02, 0.02, 0.02}, 1e-3).mesh, {0, 0, 0.02 + gap});
  const double edge = coarse.mean_edge();
  const MeshRisks risks = mesh_risks(together(coarse, fine));
  EXPECT_GE(risks.gap, gap / edge);
  EXPECT_LT(risks.gap, 1.3 * gap / edge);
  EXPECT_NEAR(mesh_risks(together(fine, coarse)).gap, risks.gap, 1e-12);
  EXPECT_NEAR(risks.gap_at.z(), 0.01 + 0.5 * gap, 1e-12);
}

}  // namespace touchfield::inspect_test
