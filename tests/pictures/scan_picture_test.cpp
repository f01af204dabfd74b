#include <gtest/gtest.h>

#include "sim/pictures/picture_parts.h"
#include "sim/pictures/plots.h"
#include "tests/support/files.h"
#include "tests/support/picture_support.h"

namespace touchfield::scan_picture_test {

/// Pixels of the marker's colour in the plot.
int marked(const Picture& picture, int from_x, int to_x, int from_y, int to_y) {
  int count = 0;
  for (int x = from_x; x < to_x; ++x) {
    for (int y = from_y; y < to_y; ++y) {
      count += has_colour(picture.at(x, y), marker_colour(0)) ? 1 : 0;
    }
  }
  return count;
}

// The plot is a square from (280, 160) to (920, 800) pixels; its ends are 0 and 10 here.
TEST(ScanPicture, HasADotWhereAPointIs) {
  const TemporaryDirectory directory;
  draw_scan(directory.file("scan.png"), {"a run", "one", "two"}, Eigen::Vector2d(2, 10), Eigen::Vector2d(8, 10),
            PictureFormat::kPng);
  const Picture picture(directory.file("scan.png"));
  EXPECT_EQ(picture.width(), kPictureWidth);
  EXPECT_EQ(picture.height(), kPictureHeight);
  EXPECT_EQ(picture.text("Description"), "a run");
  EXPECT_GT(marked(picture, 280 + 118, 280 + 138, 160 + 502, 160 + 522), 20);  // at (2, 8)
  EXPECT_EQ(marked(picture, 280 + 502, 280 + 522, 160 + 118, 160 + 138), 0);   // not at (8, 2)
}

TEST(ScanPicture, IsDrawnOfSilenceToo) {
  const TemporaryDirectory directory;
  draw_scan(directory.file("scan.svg"), {"a run", "", ""}, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Zero(1),
            PictureFormat::kSvg);
  EXPECT_EQ(directory.entries(), 1U);
}

}  // namespace touchfield::scan_picture_test
