#include "sim/mesh/remesh/cut.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"

namespace touchfield::cut_test {

using std::numbers::pi;

constexpr double kRounding = 1e-12;  // [m]

void expect_sound(const TriangleMesh& part) {
  EXPECT_THAT(inspect(part).faults, IsEmpty());
  EXPECT_THAT(self_intersections(part), IsEmpty());
  EXPECT_EQ(inspect(part).components, 1);
  EXPECT_GT(inspect(part).smallest_angle, pi / 180);
}

/// What every cut of a body that reaches out of the cube has to be.
TriangleMesh expect_cut(const TriangleMesh& mesh, const Vector3& point, double reach, const EdgeSizing& sizing) {
  TriangleMesh part = kept_within(mesh, point, reach, sizing);
  expect_sound(part);
  double farthest = 0;
  for (const auto& x : part.vertices().colwise()) {
    farthest = std::max(farthest, cube_distance(x, point));
  }
  EXPECT_NEAR(farthest / reach, 1.0, 0.07);
  EXPECT_NEAR(FaceTree(part).nearest(point).distance, FaceTree(mesh).nearest(point).distance, kRounding);
  return part;
}

TEST(KeptWithin, HasTheVolumeOfTheIntersection) {
  struct Case {
    TriangleMesh mesh;
    Vector3 point;
    double reach;
    double volume;
  };
  const double r = 0.008;
  for (const Case& c : {Case{capsule(r, 0.06, 1.2e-3).mesh, {0, 0, r}, 0.02, pi * r * r * 0.04},
                        Case{box({0.08, 0.06, 0.04}, 2.5e-3).mesh, {0.003, 0.001, 0.02}, 0.018, 0.036 * 0.036 * 0.018},
                        Case{box({0.08, 0.06, 0.04}, 2.5e-3).mesh, {0.04, 0.03, 0.02}, 0.02, std::pow(0.02, 3)},
                        Case{box({0.2, 0.2, 0.05}, 0.03).mesh, {0.012, 0.007, 0.025}, 0.03, 0.06 * 0.06 * 0.03}}) {
    const TriangleMesh part = expect_cut(c.mesh, c.point, c.reach, EdgeSizing(2.5e-3));
    EXPECT_NEAR(part.signed_volume() / c.volume, 1.0, 5e-3) << c.reach;
  }
}

// A bubble in a block is cut with it: the cap has a hole.
TEST(KeptWithin, ClosesRings) {
  const TriangleMesh outer = box({0.1, 0.1, 0.1}, 4e-3).mesh;
  const TriangleMesh bubble = shifted(sphere(0.012, 2.5e-3).mesh, {0, 0, 0.02});
  Triangles inwards = bubble.triangles();
  inwards.row(1).swap(inwards.row(2));
  const TriangleMesh body = together(outer, {bubble.vertices(), inwards});
  const TriangleMesh part = expect_cut(body, {0, 0, 0.05}, 0.03, EdgeSizing(3e-3));
  EXPECT_NEAR(part.signed_volume() / (0.06 * 0.06 * 0.03 - 2.0 / 3 * pi * std::pow(0.012, 3)), 1.0, 5e-3);
}

TEST(KeptWithin, LeavesOutOtherPiecesAndWholeBodies) {
  const TriangleMesh one = capsule(0.008, 0.06, 2.5e-3).mesh;
  const TriangleMesh body = together(one, shifted(one, {0.02, 0, 0}));
  EXPECT_LT(expect_cut(body, {0, 0, 0.008}, 0.025, EdgeSizing(2.5e-3)).vertices().row(0).maxCoeff(), 0.01);
  EXPECT_EQ(kept_within(one, {0, 0, 0}, 0.05, EdgeSizing(2.5e-3)).face_count(), one.face_count());
}

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11U) * 0x1p-53; }

// Uniform and graded hands, cut about any place of their skin.
TEST(KeptWithin, CutsHandsAnywhere) {
  std::mt19937_64 random(5);
  for (const auto& [pose, far] : {std::pair{"grasp", 10e-3}, {"flat", 5e-3}}) {
    const HandOptions options{.pose = pose, .forearm = 0.1};
    const EdgeSizing sizing(far, {{hand_landmark(options, "index_pad"), 2.4e-3, 12e-3}});
    const TriangleMesh whole = hand(options, sizing).mesh;
    for (int trial = 0; trial < 3; ++trial) {
      const auto face = static_cast<Eigen::Index>(uniform(random) * static_cast<double>(whole.face_count()));
      const double reach = 0.02 + 0.1 * uniform(random);
      SCOPED_TRACE(fmt::format("{} {} {} {}", pose, far, face, reach));
      expect_cut(whole, whole.centroids().col(face), reach, sizing);
    }
  }
}

TEST(KeptWithin, RefusesCubesWithoutSkin) {
  const TriangleMesh mesh = sphere(0.03, 3e-3).mesh;
  for (const double reach : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THAT(
        [&] {
          kept_within(mesh, {0, 0, 0.03}, reach, EdgeSizing(3e-3));
        },
        ThrowsMessage<InputError>(HasSubstr("keep_within_mm")));
  }
  EXPECT_THAT(
      [&] {
        kept_within(mesh, {0, 0, 0.05}, 0.03, EdgeSizing(3e-3));
      },
      ThrowsMessage<InputError>(HasSubstr("the nearest skin")));
}

}  // namespace touchfield::cut_test
