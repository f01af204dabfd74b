#include "sim/pictures/canvas.h"

#include <random>
#include <span>

#include "sim/core/png_file.h"
#include "sim/pictures/picture_parts.h"
#include "tests/support/files.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::canvas_test {

constexpr Colour kRed = {200, 10, 20};
constexpr Colour kWhite = {255, 255, 255};

/// The picture read back by another's reader.
class Drawn {
 public:
  explicit Drawn(const std::string& bytes) { write_bytes(directory_.file("drawn.png"), bytes); }
  Picture picture() const { return Picture(directory_.file("drawn.png")); }

 private:
  TemporaryDirectory directory_;
};

TEST(Png, IsReadBackBitByBit) {
  std::mt19937 generator(3);
  std::vector<Colour> pixels(37 * 23);
  for (Colour& pixel : pixels) {
    pixel = {static_cast<std::uint8_t>(generator()), static_cast<std::uint8_t>(generator()),
             static_cast<std::uint8_t>(generator())};
  }
  const Drawn drawn(
      png_file(37, 23, PngPixels::kRgb8, std::as_bytes(std::span(pixels)), {{"Title", "a picture"}, {"Comment", ""}}));
  const Picture picture = drawn.picture();
  ASSERT_EQ(picture.width(), 37);
  ASSERT_EQ(picture.height(), 23);
  EXPECT_EQ(picture.text("Title"), "a picture");
  EXPECT_EQ(picture.text("Comment"), "(none)");
  for (int row = 0; row < 23; ++row) {
    for (int column = 0; column < 37; ++column) {
      ASSERT_EQ(picture.at(column, 22 - row), pixels[static_cast<std::size_t>(37 * row + column)])
          << column << ", " << row;
    }
  }
}

TEST(Canvas, CountsPixelsFromTheLowerLeftCorner) {
  Canvas canvas(60, 40);
  canvas.polygon({{10, 5}, {20, 5}, {20, 15}, {10, 15}}, kRed);
  canvas.image({40, 20, 8, 6}, [](int i, int j) { return i == 7 && j == 5 ? kRed : Colour{10, 20, 200}; });
  canvas.line({0, 35}, {60, 35}, kRed, 1.0);
  const Drawn drawn(canvas.file());
  const Picture picture = drawn.picture();
  expect_colour(picture.at(10, 5), kRed);
  expect_colour(picture.at(19, 14), kRed);
  expect_colour(picture.at(9, 5), kWhite);
  expect_colour(picture.at(19, 15), kWhite);
  expect_colour(picture.at(47, 25), kRed);
  expect_colour(picture.at(40, 25), {10, 20, 200});
  expect_colour(picture.at(40, 20), {10, 20, 200});
  expect_colour(picture.at(48, 25), kWhite);
  // A line of a pixel's width fills one row and no other.
  int rows = 0;
  for (int y = 30; y < 40; ++y) rows += picture.at(30, y) == kWhite ? 0 : 1;
  EXPECT_EQ(rows, 1);
}

/// Left, lower, right and upper end of what is not white.
Eigen::Vector4i extent(const Picture& picture) {
  Eigen::Vector4i box(picture.width(), picture.height(), -1, -1);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (picture.at(x, y) != kWhite) {
        box << std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y);
      }
    }
  }
  return box;
}

TEST(Canvas, TextStandsWhereItsStyleSays) {
  const auto drawn = [](const TextStyle& style) {
    Canvas canvas(400, 400);
    canvas.text(200, 200, "HHHH", style);
    return extent(Drawn(canvas.file()).picture());
  };
  Canvas ruler(10, 10);
  const double width = ruler.text_width("HHHH", {.size = 30});
  EXPECT_GT(width, 40.0);
  EXPECT_NEAR(ruler.text_width("HHHH", {.size = 15}), 0.5 * width, 0.02 * width);
  // 5: a letter's own room beside its strokes.
  EXPECT_NEAR(drawn({.size = 30})[0], 200, 5);
  EXPECT_NEAR(drawn({.size = 30})[2], 200 + width, 5);
  EXPECT_NEAR(drawn({.size = 30, .align = Align::kRight})[2], 200, 5);
  const Eigen::Vector4i centred = drawn({.size = 30, .align = Align::kCentre});
  EXPECT_NEAR(0.5 * (centred[0] + centred[2]), 200, 2);
  EXPECT_NEAR(0.5 * (centred[1] + centred[3]), 200, 2);
  const Eigen::Vector4i upright = drawn({.size = 30, .align = Align::kCentre, .angle = 90.0});
  EXPECT_NEAR(upright[3] - upright[1], width, 10);
  EXPECT_NEAR(0.5 * (upright[0] + upright[2]), 200, 2);
}

TEST(Canvas, HasAFontOrSaysThatThereIsNone) {
  const std::string font = picture_font();
  EXPECT_EQ(font.find_first_of("\n\t"), std::string::npos);
  Canvas canvas(100, 50);
  EXPECT_GT(canvas.text_width("abc", {}), 0.0) << "font '" << font << "'";
}

}  // namespace touchfield::canvas_test
