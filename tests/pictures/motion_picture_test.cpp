#include "sim/pictures/figures.h"
#include "sim/pictures/plots.h"
#include "sim/pictures/skin_picture.h"
#include "sim/run/text_table.h"
#include "tests/support/motion_support.h"
#include "tests/support/output_support.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::motion_picture_test {

int pixels_within(const Picture& picture, const PixelBox& box, const Colour& colour) {
  int count = 0;
  for (int y = box.y; y < box.y + box.height; ++y) {
    for (int x = box.x; x < box.x + box.width; ++x) count += has_colour(picture.at(x, y), colour) ? 1 : 0;
  }
  return count;
}

TEST(MotionPicture, HasALineAMethodInEveryPanel) {
  const TemporaryDirectory directory;
  const Motion motion = long_motion({"surface", "paper", "unscattered"});
  ASSERT_TRUE(draw_motion(directory.file("motion.png"), motion));
  EXPECT_EQ(directory.entries(), 1U);
  const Picture picture(directory.file("motion.png"));
  EXPECT_EQ(picture.width(), 1200);
  EXPECT_EQ(picture.height(), 900);
  EXPECT_EQ(picture.text("Description"), "to and fro");
  EXPECT_EQ(picture.text("Scene hash"), "abc");
  for (const int bottom : {140, 359, 579}) {  // panels of 760 x 197 pixels, axes from 0 to 2 s
    for (const std::size_t method : {0U, 1U, 2U}) {
      EXPECT_GT(pixels_within(picture, {120, bottom, 760, 197}, line_colour(method)), 300) << bottom << " " << method;
    }
    EXPECT_LT(pixels_within(picture, {120, bottom, 760, 197}, line_colour(3)), 5);
    // Silent from 60/61 to 70/61 s: no line in the middle of that time, of the axis' 2 s.
    for (const std::size_t method : {0U, 1U, 2U}) {
      EXPECT_EQ(pixels_within(picture, {520, bottom, 20, 197}, line_colour(method)), 0) << bottom;
    }
  }
}

/// A sheet that moves to the left as it is seen, a target of 1000 Pa on its middle square, |p| the same everywhere.
std::vector<MotionInstant> instants_of(const std::vector<std::pair<std::string, double>>& methods) {
  std::vector<MotionInstant> instants;
  for (int i = 0; i < 6; ++i) {
    MotionInstant& instant = instants.emplace_back(
        MotionInstant{.time = 20 * i / 61.0,
                      .mesh = transformed(sheet(21, 21, 2e-3), Eigen::Matrix3d::Identity(), Vector3(1e-3 * i, 0, 0)),
                      .target = Target{.faces = {440, 441},
                                       .amplitudes = Eigen::Vector2d(1000, 1000),
                                       .box = {0, 0},
                                       .shares = Eigen::Vector2d(1, 1)}});
    for (const auto& [name, pressure] : methods) {
      instant.pressure.emplace_back(name, Eigen::VectorXcd::Constant(instant.mesh.face_count(), pressure));
    }
  }
  return instants;
}

TEST(MotionStrip, HasARowAMethodAndAColumnAnInstant) {
  const TemporaryDirectory directory;
  Motion motion = long_motion({"surface", "paper"});
  motion.instants = instants_of({{"surface", 500.0}, {"paper", 1500.0}});
  write_text_file(directory.file("strip.png"), motion_strip(motion));
  const Picture picture(directory.file("strip.png"));
  EXPECT_EQ(picture.width(), 1200);
  EXPECT_EQ(picture.height(), 900);
  EXPECT_EQ(picture.text("Description"), "to and fro");
  // Colours end at the largest pressure, 1500 Pa. Each panel is full of its skin's colour but for an outline.
  const PanelGrid grid = filled_grid({64, 84, 996, 700}, 12, 6, 26);
  for (int column = 0; column < 6; ++column) {
    EXPECT_GT(pixels_within(picture, grid.panel(column), skin_colour(1.0 / 3.0)), 40'000) << column;
    EXPECT_GT(pixels_within(picture, grid.panel(6 + column), skin_colour(1.0)), 40'000) << column;
  }
  // The place is the same, so the target wanders: +x lies to the left.
  const auto mean_x = [&](int column) {
    double sum = 0;
    int count = 0;
    const PixelBox panel = grid.panel(6 + column);
    for (int y = panel.y; y < panel.y + panel.height; ++y) {
      for (int x = panel.x + 1; x < panel.x + panel.width - 1; ++x) {
        if (has_colour(picture.at(x, y), kTargetColour)) {
          sum += x - panel.x;
          ++count;
        }
      }
    }
    EXPECT_GT(count, 10) << column;
    return sum / count;
  };
  for (int column = 1; column < 6; ++column) EXPECT_LT(mean_x(column), mean_x(column - 1) - 5.0) << column;
}

}  // namespace touchfield::motion_picture_test
