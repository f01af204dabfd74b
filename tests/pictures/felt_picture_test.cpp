#include "sim/pictures/figures.h"
#include "sim/pictures/plots.h"
#include "sim/run/text_table.h"
#include "tests/support/felt_support.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::felt_picture_test {

/// A point of a map [pixels of the picture]; maps are 146 pixels wide, from the upper left.
Eigen::Vector2d pixel(const Picture& picture, int row, int column, const Eigen::Vector2d& place) {
  const double left = 116 + 216 * column;
  const double bottom = picture.height() - 150 - 172 * (row + 1) - 8 * row;
  return Eigen::Vector2d(left, bottom) + 146 * (place / 24e-3 + Eigen::Vector2d(0.5, 0.5));
}

TEST(FeltPicture, HasARowAMethodAndOneScaleAColumn) {
  const TemporaryDirectory directory;
  const Felt felt = made_up_felt({{"strong", 10.0}, {"weak", 6.0}});
  write_text_file(directory.file("felt.png"), felt_picture(felt));
  const Picture picture(directory.file("felt.png"));
  EXPECT_EQ(picture.width(), 1200);
  EXPECT_EQ(picture.height(), 150 + 2 * 180 + 140);
  EXPECT_EQ(picture.text("Description"), "spots, vibration of the skin");
  EXPECT_EQ(picture.text("Scene hash"), "abc");
  for (const int column : {0, 1, 2, 3, 4}) {
    const auto map = [&](const FeltMethod& method) {
      return column == 4 ? method.skins[1].energy[2] : method.skins[column == 0 ? 3U : column - 1U].displacement;
    };
    const double unit = column == 0 ? 1.0 : 1e6;
    const double top = round_above(unit * largest(map(felt.methods[0])));
    for (const int row : {0, 1}) {
      for (const Eigen::Vector2d& place : {Eigen::Vector2d(1e-3, 1e-3), Eigen::Vector2d(-5e-3, 4e-3)}) {
        const Eigen::Vector2d at = pixel(picture, row, column, place);
        const Eigen::Vector2d middle = at.array().floor() + 0.5;
        const double value =
            map_at(map(felt.methods[static_cast<std::size_t>(row)]), place + (middle - at) * 24e-3 / 146);
        expect_colour(picture.at(at), viridis(unit * value / top));
      }
      expect_colour(picture.at(pixel(picture, row, column, {-11.5e-3, -11.5e-3})), kPaper);  // off the patch
    }
  }
}

}  // namespace touchfield::felt_picture_test
