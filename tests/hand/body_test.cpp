#include "sim/hand/body.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Geometry>

#include "sim/hand/shapes.h"
#include "tests/support/testing.h"

namespace touchfield::body_test {

constexpr double kRounding = 1e-15;  // [m] of bodies below a metre

TEST(FindLandmark, ListsTheNamesThereAre) {
  const Body body = sphere(0.01, 0.005);
  EXPECT_EQ(find_landmark(body, "top").name, "top");
  EXPECT_THAT([&] { find_landmark(body, "index_pad"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("'index_pad'"), HasSubstr("top, bottom, x_plus"))));
  EXPECT_THAT([&] { find_landmark(Body{body.mesh, {}}, "top"); }, ThrowsMessage<InputError>(HasSubstr("it has none")));
}

// On a box the nearest point is known: the point clamped to the box.
TEST(NearestLandmark, IsTheNearestPointOfTheSurface) {
  const Vector3 half(0.01, 0.02, 0.03);
  const TriangleMesh mesh = box(2.0 * half, 0.004).mesh;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.06, 0.06);
  for (int i = 0; i < 200; ++i) {
    const Vector3 outside(uniform(random), uniform(random), uniform(random));
    if ((outside.cwiseAbs() - half).maxCoeff() <= 0) {
      continue;
    }
    const Landmark landmark = nearest_landmark(mesh, "p", outside);
    const Vector3 expected = outside.cwiseMax(-half).cwiseMin(half);
    EXPECT_LT((position(mesh, landmark) - expected).norm(), 1e-12) << outside.transpose();
    EXPECT_NEAR(landmark.barycentric.sum(), 1.0, 1e-12);
    EXPECT_GE(landmark.barycentric.minCoeff(), 0.0);
  }
  const Vector3 nowhere(0, std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_THROW(nearest_landmark(mesh, "p", nowhere), InputError);
}

// First about the fixed x: y goes to z; then about the fixed z: z stays. (Intrinsic turns would take y to x's place.)
TEST(Placed, TurnsAboutFixedAxesInOrderAboutTheAnchor) {
  const Body body = box({0.02, 0.04, 0.06}, 0.02);
  const Vector3 anchor = position(body.mesh, find_landmark(body, "y_plus"));  // (0, 20 mm, 0)
  const Vector3 at(0.1, -0.2, 0.3);
  const Body moved = placed(body, anchor, at, {std::numbers::pi / 2, 0, std::numbers::pi / 2});
  EXPECT_LT((position(moved.mesh, find_landmark(moved, "y_plus")) - at).norm(), kRounding);
  const Vector3 centre_at = moved.mesh.vertices().rowwise().mean();
  // From the anchor the centre lies 20 mm along -y: about x by 90 degrees it lies along -z, about z it stays there.
  EXPECT_LT((centre_at - at - Vector3(0, 0, -0.02)).norm(), kRounding);
}

}  // namespace touchfield::body_test
