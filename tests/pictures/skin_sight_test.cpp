#include "sim/pictures/skin_sight.h"

#include "sim/pictures/figures.h"
#include "tests/support/output_support.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::skin_sight_test {

constexpr PixelBox kPanel = {10, 20, 40, 30};

/// Straight along +z; a pixel is a millimetre, the origin in the panel's middle.
SkinView view_along_z() {
  return {
      .panel = kPanel, .direction = Vector3::UnitZ(), .up = Vector3::UnitY(), .centre = Vector3::Zero(), .scale = 1e-3};
}

TriangleMesh triangle(const Vector3& a, const Vector3& b, const Vector3& c) {
  Points corners(3, 3);
  corners << a, b, c;
  return {corners, Eigen::Vector3i(0, 1, 2)};
}

TEST(SkinSight, PixelsAreMeansOfWhatTheyHold) {
  // Its left side runs 4.25 pixels right of the middle, which is left as one sees it: +x points to the left.
  const TriangleMesh mesh = triangle({-4.25e-3, -1, 0}, {-4.25e-3, 1, 0}, {-1, 0, 0});
  const SkinSight sight(view_along_z(), mesh);
  const ColourImage image = sight.image({{200, 100, 0}}, 1);
  ASSERT_EQ(image.width, kPanel.width);
  ASSERT_EQ(image.height, kPanel.height);
  expect_colour(image.at(23, 15), {255, 255, 255});
  expect_colour(image.at(24, 15), {214, 139, 64});  // three quarters
  expect_colour(image.at(25, 15), {200, 100, 0});
  const ColourImage finer = sight.image({{200, 100, 0}}, 4);
  ASSERT_EQ(finer.width, 4 * kPanel.width);
  expect_colour(finer.at(96, 60), {255, 255, 255});
  expect_colour(finer.at(97, 60), {200, 100, 0});
}

// 0.7 + 0.3 cos 60 degrees
TEST(SkinSight, SlantedFacesAreShaded) {
  const double depth = 2.0 * std::tan(std::acos(-1.0) / 3.0);
  const TriangleMesh mesh = triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, depth});
  const ColourImage image = SkinSight(view_along_z(), mesh).image({{200, 100, 0}}, 1);
  expect_colour(image.at(20, 15), {170, 85, 0});
}

TEST(SkinSight, EdgesBehindFacesAreLeftOut) {
  const TriangleMesh near = triangle({0, -1, 0}, {0, 1, 0}, {-1, 0, 0});  // the right half of the panel
  const SkinSight sight(view_along_z(), near);
  Points points(3, 4);
  points << 8e-3, -8e-3, 8e-3, -8e-3, 0, 0, 4e-3, 4e-3, 0.1, 0.1, -0.1, -0.1;  // one behind, one before it
  Eigen::Matrix2Xi edges(2, 2);
  edges << 0, 2, 1, 3;
  const std::vector<Eigen::Vector2d> ends = sight.visible(points, edges);
  ASSERT_EQ(ends.size(), 4U);
  EXPECT_TRUE(ends[0].isApprox(Eigen::Vector2d(22, 35)));
  EXPECT_NEAR(ends[1].x(), 30.0, 1.0);
  EXPECT_TRUE(ends[2].isApprox(Eigen::Vector2d(22, 39)));
  EXPECT_TRUE(ends[3].isApprox(Eigen::Vector2d(38, 39)));
}

TEST(SetupPicture, DiscsStandWhereTheTransducersAre) {
  TransducerArray array = bare_run(sheet(1, 1, 0.01)).array;  // 10 mm apart
  array.axes.col(0) = Vector3(0, 0.6, 0.8);
  const TriangleMesh discs = transducer_discs(array);
  ASSERT_EQ(discs.vertex_count(), 16 * array.size());
  for (Eigen::Index v = 0; v < discs.vertex_count(); ++v) {
    const Vector3 offset = discs.vertices().col(v) - array.positions.col(v / 16);
    EXPECT_NEAR(offset.norm(), 4.5e-3, 1e-12);
    EXPECT_NEAR(offset.dot(array.axes.col(v / 16)), 0.0, 1e-15);
  }
  array.positions = array.positions.leftCols(1).eval();
  array.axes = array.axes.leftCols(1).eval();
  EXPECT_NEAR((transducer_discs(array).vertices().col(0) - array.positions.col(0)).norm(), 5e-3, 1e-12);
}

}  // namespace touchfield::skin_sight_test
