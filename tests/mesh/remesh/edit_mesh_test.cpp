#include "sim/mesh/remesh/edit_mesh.h"

#include <array>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/remesh.h"
#include "tests/support/testing.h"

namespace touchfield::edit_mesh_test {

using std::numbers::pi;

/// Every relation between sides, and the valences, by their definition.
void expect_consistent(const EditMesh& mesh) {
  std::vector<int> valence(static_cast<std::size_t>(mesh.vertex_count()), 0);
  for (int side = 0; side < mesh.side_count(); ++side) {
    if (mesh.alive(side)) {
      const int other = mesh.opposite(side);
      ASSERT_TRUE(mesh.alive(other));
      ASSERT_EQ(mesh.opposite(other), side);
      ASSERT_EQ(mesh.from(other), mesh.to(side));
      ASSERT_EQ(mesh.to(other), mesh.from(side));
      ASSERT_EQ(mesh.label(other), mesh.label(side));
      ++valence[static_cast<std::size_t>(mesh.from(side))];
    }
  }
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.vertex_alive(v)) {
      ASSERT_EQ(mesh.valence(v), valence[static_cast<std::size_t>(v)]);
      int count = 0;
      for (const int side : mesh.around(v)) {
        ASSERT_EQ(mesh.from(side), v);
        ASSERT_LE(++count, mesh.valence(v));
      }
      ASSERT_EQ(count, mesh.valence(v)) << "the faces about a vertex form one fan";
    } else {
      ASSERT_EQ(valence[static_cast<std::size_t>(v)], 0);
    }
  }
}

TEST(EditMesh, StaysAClosedManifoldThroughRandomChanges) {
  const TriangleMesh start = icosphere(1.0, 3);
  EditMesh mesh(start.triangles(), start.vertex_count());
  std::mt19937 random(2);
  int collapses = 0;
  int flips = 0;
  for (int i = 0; i < 6000; ++i) {
    const int side = std::uniform_int_distribution<int>(0, mesh.side_count() - 1)(random);
    const int what = std::uniform_int_distribution<int>(0, 3)(random);
    if (!mesh.alive(side)) {
      continue;
    }
    if (what == 0 && i < 3000) {
      mesh.split(side);
    } else if (what <= 2 && mesh.can_collapse(side)) {
      mesh.collapse(side);
      ++collapses;
    } else if (what == 3 && mesh.can_flip(side)) {
      mesh.flip(side);
      ++flips;
    }
    if (i % 50 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_consistent(mesh)) << i;
    }
  }
  EXPECT_GT(collapses, 100);
  EXPECT_GT(flips, 100);
  ASSERT_NO_FATAL_FAILURE(expect_consistent(mesh));
  std::vector<int> numbers;
  const Triangles triangles = mesh.compact(numbers);
  EXPECT_EQ(static_cast<Eigen::Index>(numbers.size()) - triangles.cols() / 2, 2) << "still a sphere";
}

TEST(EditMesh, RefusesASurfaceThatIsOpenOrMisoriented) {
  const TriangleMesh ball = icosphere(1.0, 1);
  EXPECT_THROW(EditMesh(ball.triangles().leftCols(19), ball.vertex_count()), InputError);
  Triangles flipped = ball.triangles();
  std::swap(flipped(0, 3), flipped(1, 3));
  EXPECT_THROW(EditMesh(flipped, ball.vertex_count()), InputError);
}

void project_on_sphere(Points& points) { points.colwise().normalize(); }

TEST(Remesh, ReachesTheWantedEdgeFromCoarseAndFine) {
  for (const int f : {1, 4, 60}) {
    const TriangleMesh start = icosphere(1.0, f);
    const RemeshTarget target{
        [](const Points& points) { return Eigen::VectorXd(Eigen::VectorXd::Constant(points.cols(), 0.1)); },
        project_on_sphere};
    const TriangleMesh mesh = remeshed(start.vertices(), start.triangles(), target, 8);
    const MeshReport report = inspect(mesh);
    EXPECT_THAT(report.faults, IsEmpty());
    EXPECT_EQ(report.vertices - report.faces / 2, 2);
    EXPECT_NEAR(mesh.mean_edge() / 0.1, 1.0, 0.03) << f;
    EXPECT_GT(report.smallest_angle, 25 * pi / 180) << f;
    EXPECT_NEAR(mesh.vertices().colwise().norm().minCoeff(), 1.0, 1e-12);
  }
}

}  // namespace touchfield::edit_mesh_test
