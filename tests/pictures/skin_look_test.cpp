#include "sim/pictures/skin_picture.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::skin_look_test {

constexpr PixelBox kPanel = {10, 20, 40, 30};

/// Straight along +z; a pixel is a millimetre, the origin in the panel's middle.
SkinView view_along_z() {
  return {
      .panel = kPanel, .direction = Vector3::UnitZ(), .up = Vector3::UnitY(), .centre = Vector3::Zero(), .scale = 1e-3};
}

ColourAt plain(const Colour& colour) {
  return [colour](int, const Vector3&) { return colour; };
}

TriangleMesh triangle(const Vector3& a, const Vector3& b, const Vector3& c) {
  Points corners(3, 3);
  corners << a, b, c;
  return {corners, Eigen::Vector3i(0, 1, 2)};
}

TEST(SkinLook, PixelsAreMeansOfWhatTheyHold) {
  // Its left side runs 4.25 pixels right of the middle, which is left as one sees it: +x points to the left.
  const TriangleMesh mesh = triangle({-4.25e-3, -1, 0}, {-4.25e-3, 1, 0}, {-1, 0, 0});
  const SkinLook look(view_along_z(), mesh, std::nullopt);
  const auto pixel = [&](int i) { return look.pixel(i, 15, plain({200, 100, 0})); };
  expect_colour(pixel(23), {255, 255, 255});
  expect_colour(pixel(24), {214, 139, 64});  // three quarters
  expect_colour(pixel(25), {200, 100, 0});
  // A colour that grows with the share of the third corner, 1 m away: by 0.1 % a pixel.
  const auto share = [&](int i) {
    return look.pixel(i, 15, [](int, const Vector3& shares) {
      EXPECT_NEAR(shares.sum(), 1.0, 1e-12);
      return Colour{static_cast<std::uint8_t>(10'000.0 * shares[2]), 0, 0};
    });
  };
  EXPECT_NEAR(share(36)[0] - share(30)[0], 60, 2);
}

// 0.7 + 0.3 cos 60 degrees
TEST(SkinLook, SlantedFacesAreShaded) {
  const double depth = 2.0 * std::tan(std::acos(-1.0) / 3.0);
  const TriangleMesh mesh = triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, depth});
  const SkinLook look(view_along_z(), mesh, std::nullopt);
  expect_colour(look.pixel(20, 15, plain({200, 100, 0})), {170, 85, 0});
}

TEST(SkinLook, EdgesBehindFacesAreLeftOut) {
  const TriangleMesh near = triangle({0, -1, 0}, {0, 1, 0}, {-1, 0, 0});  // the right half of the panel
  const SkinLook look(view_along_z(), near, std::nullopt);
  Points points(3, 4);
  points << 8e-3, -8e-3, 8e-3, -8e-3, 0, 0, 4e-3, 4e-3, 0.1, 0.1, -0.1, -0.1;  // one behind, one before it
  const std::vector<Eigen::Vector2d> ends = look.visible(points);
  ASSERT_EQ(ends.size(), 4U);
  EXPECT_TRUE(ends[0].isApprox(Eigen::Vector2d(22, 35)));
  EXPECT_NEAR(ends[1].x(), 30.0, 1.0);
  EXPECT_TRUE(ends[2].isApprox(Eigen::Vector2d(22, 39)));
  EXPECT_TRUE(ends[3].isApprox(Eigen::Vector2d(38, 39)));
}

TEST(SkinLook, ValuesAreMeansByAreaAtTheVertices) {
  Points corners(3, 4);
  corners << 0, 2, 0, -1, 0, 0, 2, 0, 0, 0, 0, 0;  // areas 2 and 1
  Triangles faces(3, 2);
  faces << 0, 0, 1, 2, 2, 3;
  const TriangleMesh mesh(corners, faces);
  EXPECT_TRUE(vertex_means(mesh, Eigen::RowVector2d(3, 9)).isApprox(Eigen::RowVector4d(5, 3, 5, 9)));
  const Eigen::MatrixXd known = vertex_means(mesh, Eigen::RowVector2d(3, NAN));
  EXPECT_TRUE(known.leftCols(3).isApprox(Eigen::RowVector3d(3, 3, 3)));
  EXPECT_TRUE(std::isnan(known(3)));
}

}  // namespace touchfield::skin_look_test
