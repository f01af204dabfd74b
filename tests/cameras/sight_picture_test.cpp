#include "sim/cameras/see_scene.h"
#include "sim/pictures/picture_parts.h"
#include "tests/support/files.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::sight_picture_test {

constexpr Colour kHoleRed = {235, 30, 60};

/// Looks along +z at a plate in the right half of its image, 0.3 m away at the left and 0.4 m at the right.
CameraSight sight(bool whole) {
  Camera camera;
  camera.width = 64;
  camera.height = 36;
  camera.focal.setConstant(50);
  camera.centre << 32, 18;
  camera.near = 0.01;
  std::vector<float> depth(64 * 36, 0.0F);
  for (std::size_t p = 0; p < depth.size(); ++p) {
    depth[p] = p % 64 < 32 || (!whole && p % 64 < 48) ? 0.0F : 0.4F;
  }
  return {"camera_1", camera, depth};
}

TriangleMesh plate() {
  Points corners(3, 4);
  corners << 0, 0.5, 0.5, 0, -0.5, -0.5, 0.5, 0.5, 0.3, 0.5, 0.5, 0.3;
  Triangles faces(3, 2);
  faces << 0, 0, 2, 3, 1, 2;
  return {corners, faces};
}

int counted(const Picture& picture, const Colour& colour, int from_x, int to_x) {
  int count = 0;
  for (int x = from_x; x < to_x; ++x) {
    for (int y = 0; y < picture.height(); ++y) count += has_colour(picture.at(x, y), colour) ? 1 : 0;
  }
  return count;
}

TEST(SightPicture, MarksHolesInRed) {
  const TemporaryDirectory directory;
  const auto reds = [&](const std::vector<CameraSight>& sights) {
    draw_sights(directory.file("sight.png"), "a scene", "its first frame", plate(), sights);
    const Picture picture(directory.file("sight.png"));
    EXPECT_EQ(picture.width(), kPictureWidth);
    EXPECT_EQ(picture.text("Description"), "a scene");
    return counted(picture, kHoleRed, 0, 1040);
  };
  EXPECT_EQ(reds({sight(true)}), 0);
  const int one = reds({sight(false)});
  EXPECT_GT(one, 10'000);
  EXPECT_GT(reds({sight(false), sight(false)}), one);
  EXPECT_GT(reds(std::vector<CameraSight>(8, sight(false))), 10'000);
}

}  // namespace touchfield::sight_picture_test
