#include "sim/mesh/cut/boundary_loops.h"

#include <algorithm>
#include <array>
#include <vector>

#include "sim/body/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/subset.h"
#include "tests/support/testing.h"

namespace touchfield::boundary_loops_test {

Triangles as_triangles(const std::vector<std::array<int, 3>>& faces) { return as_columns(faces); }

TEST(BoundaryLoops, RunAgainstTheFacesBesideThem) {
  EXPECT_THAT(boundary_loops(as_triangles({{0, 1, 2}}), 3), ElementsAre(ElementsAre(2, 1, 0)));
  const TriangleMesh sphere = icosphere(1.0, 3);
  EXPECT_THAT(boundary_loops(sphere.triangles(), static_cast<int>(sphere.vertex_count())), IsEmpty());
  EXPECT_THAT(boundary_loops(Triangles(3, 0), 0), IsEmpty());
}

// Two holes whose rims touch in vertex 0, and two sheets that touch there: each loop passes it once.
TEST(BoundaryLoops, PassNoVertexTwice) {
  const std::vector<std::vector<int>> sheets = boundary_loops(as_triangles({{0, 1, 2}, {0, 3, 4}}), 5);
  EXPECT_THAT(sheets, UnorderedElementsAre(UnorderedElementsAre(0, 1, 2), UnorderedElementsAre(0, 3, 4)));

  const TriangleMesh mesh = icosphere(1.0, 4);
  // Two faces of one vertex that share no edge with each other.
  std::vector<Eigen::Index> fan;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if ((mesh.triangles().col(f).array() == 0).any()) {
      const auto shares_edge = [&](Eigen::Index other) {
        int shared = 0;
        for (const int v : mesh.triangles().col(f)) {
          shared += (mesh.triangles().col(other).array() == v).any() ? 1 : 0;
        }
        return shared > 1;
      };
      if (std::none_of(fan.begin(), fan.end(), shares_edge)) {
        fan.push_back(f);
      }
    }
  }
  ASSERT_GE(fan.size(), 2u);
  const Triangles open = faces_where(mesh.triangles(), [&](Eigen::Index f) { return f != fan[0] && f != fan[1]; });
  const auto loops = boundary_loops(open, static_cast<int>(mesh.vertex_count()));
  ASSERT_THAT(loops, ElementsAre(SizeIs(3), SizeIs(3)));
  Triangles closed(3, open.cols() + 2);
  closed << open, as_triangles({{loops[0][0], loops[0][1], loops[0][2]}, {loops[1][0], loops[1][1], loops[1][2]}});
  EXPECT_THAT(inspect({mesh.vertices(), closed}).faults, IsEmpty());
}

TEST(BoundaryLoops, RefusesWhatIsNotOriented) {
  EXPECT_THAT(
      [] {
        boundary_loops(as_triangles({{0, 1, 2}, {0, 1, 3}}), 4);
      },
      ThrowsMessage<InputError>(HasSubstr("run the same way")));
  EXPECT_THAT([] { boundary_loops(as_triangles({{0, 1, 1}}), 2); }, ThrowsMessage<InputError>(HasSubstr("twice")));
}

}  // namespace touchfield::boundary_loops_test
