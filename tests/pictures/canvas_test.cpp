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

TEST(Canvas, HasAFontOrSaysThatThereIsNone) {
  const std::string font = picture_font();
  EXPECT_EQ(font.find_first_of("\n\t"), std::string::npos);
  Canvas canvas(100, 50);
  EXPECT_GT(canvas.text_width("abc", {}), 0.0) << "font '" << font << "'";
}

}  // namespace touchfield::canvas_test
