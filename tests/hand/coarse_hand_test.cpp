#include <algorithm>
#include <string>
#include <vector>

#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_pose.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "tests/support/testing.h"

namespace touchfield::coarse_hand_test {

constexpr double kMm = kMillimetre;

HandOptions options_of(const std::string& pose, double edge = 12 * kMm) {
  HandOptions options;
  options.pose = pose;
  options.edge = edge;
  return options;
}

/// Graded about the index pad; near 0: uniform.
struct Edges {
  double near_mm;
  double far_mm;
};

TriangleMesh meshed(const HandOptions& options, const Edges& edges) {
  if (edges.near_mm == 0) {
    return hand(options, EdgeSizing(edges.far_mm * kMm)).mesh;
  }
  const Vector3 pad = hand_landmark(options, "index_pad");
  return hand(options, EdgeSizing(edges.far_mm * kMm, {{pad, edges.near_mm * kMm, 15 * kMm}})).mesh;
}

void expect_sound(const TriangleMesh& mesh) {
  const MeshReport report = inspect(mesh);
  EXPECT_THAT(report.faults, IsEmpty());
  EXPECT_EQ(report.components, 1);
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
}

/// Greatest distance of the vertices of one mesh from another [m].
double greatest_distance(const TriangleMesh& from, const TriangleMesh& to) {
  const FaceTree tree(to);
  double most = 0;
  for (const auto& x : from.vertices().colwise()) {
    most = std::max(most, tree.nearest(x).distance);
  }
  return most;
}

/// A pose, and whether every grading and size is tried.
class CoarseHand : public ::testing::TestWithParam<std::tuple<const char*, bool>> {};

// Measured against edges of 1.2 mm: volume -0.9 to 0.05 %, skin within 5.5 mm; without the bounds of skin_mesh 27 mm.
TEST_P(CoarseHand, KeepsItsShape) {
  const auto [pose, all] = GetParam();
  const HandOptions options = options_of(pose);
  const TriangleMesh fine = meshed(options, {0, all ? 1.2 : 2.4});
  std::vector<std::pair<Edges, int>> gradings = {{{1.2, 6.5}, 5200}, {{0, 12}, 1250}};
  if (all) {
    gradings.insert(gradings.end(), {{{2.4, 8}, 2500}, {{0.8, 12}, 6500}, {{2.4, 12}, 2000}});
  }
  for (const auto& [edges, faces] : gradings) {
    SCOPED_TRACE(testing::Message() << "near " << edges.near_mm << " far " << edges.far_mm);
    const TriangleMesh mesh = meshed(options, edges);
    expect_sound(mesh);
    EXPECT_LT(mesh.face_count(), faces);
    EXPECT_NEAR(mesh.signed_volume() / fine.signed_volume(), 1.0, 0.012);
    EXPECT_LT(greatest_distance(fine, mesh), 6.5 * kMm);
    EXPECT_LT(greatest_distance(mesh, fine), 0.1 * edges.far_mm * kMm + 0.1 * kMm);  // as the vertices stand off
  }
}

INSTANTIATE_TEST_SUITE_P(Poses, CoarseHand,
                         ::testing::Combine(::testing::Values("index_up", "grasp"), ::testing::Values(false)));
INSTANTIATE_TEST_SUITE_P(Full, CoarseHand,
                         ::testing::Combine(::testing::Values("flat", "index_up", "grasp", "point_down", "fist"),
                                            ::testing::Values(true)));

// Faces of 8 mm cut each other between the fingers of grasp, and so they did before edges were shortened there.
TEST(CoarseHand, MeshesAgainWhereTheSkinCutsItself) { expect_sound(hand(options_of("grasp", 8 * kMm)).mesh); }

}  // namespace touchfield::coarse_hand_test
