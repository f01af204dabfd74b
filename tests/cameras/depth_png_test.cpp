#include <random>

#include "sim/cameras/depth_camera.h"
#include "tests/cameras/recording_support.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::depth_png_test {

constexpr int kWidth = 24;
constexpr int kHeight = 16;
constexpr std::size_t kPixels = 384;
constexpr double kUnit = 1e-4;

class DepthPng : public ::testing::Test {
 protected:
  std::string good() const {
    write_depth_png(path_, made_up_image(small_camera("left"), 1), kUnit);
    return read_bytes(path_);
  }
  /// What both the check of the header and the reader say of a file.
  std::string refusal(const std::string& bytes) const {
    write_bytes(path_, bytes);
    std::string checked = message_of<InputError>([&] { check_depth_png(path_, kWidth, kHeight); });
    EXPECT_EQ(message_of<InputError>([&] { read(); }), checked);
    return checked;
  }
  /// What only unpacking tells.
  std::string damage(const std::string& bytes) const {
    write_bytes(path_, bytes);
    check_depth_png(path_, kWidth, kHeight);
    return message_of<InputError>([&] { read(); });
  }
  DepthImage read() const { return read_depth_png(path_, kUnit, kWidth, kHeight); }

  TemporaryDirectory folder_;
  std::string path_ = folder_.file("left.png");
};

TEST_F(DepthPng, KeepsDepthsToHalfAUnit) {
  const DepthImage image = made_up_image(small_camera("left"), 1);
  for (const double unit : {1e-5, 1e-4, 1e-3}) {
    write_depth_png(path_, image, unit);
    const DepthImage back = read_depth_png(path_, unit, kWidth, kHeight);
    ASSERT_EQ(back.depth.size(), image.depth.size());
    double worst = 0;
    for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel) {
      const double off = std::abs(static_cast<double>(back.depth[pixel]) - static_cast<double>(image.depth[pixel]));
      worst = std::max(worst, off);
      EXPECT_EQ(back.depth[pixel] == 0.0F, image.depth[pixel] == 0.0F);
    }
    EXPECT_LE(worst, 0.5 * unit + 1e-7);
    EXPECT_GT(worst, 0.4 * unit);
  }
}

TEST_F(DepthPng, DepthsThatAreNoneAreRefused) {
  for (const float wrong : {-0.1F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    EXPECT_THAT(message_of<InputError>([&] {
                  write_depth_png(path_, {2, 2, {0.1F, 0.1F, wrong, 0.1F}}, kUnit);
                }),
                HasSubstr("at pixel (0, 1), must be finite and >= 0"));
  }
  EXPECT_THAT(message_of<InputError>([&] {
                write_depth_png(path_, {2, 2, {0.1F}}, kUnit);
              }),
              EndsWith("left.png: 1 depths, must be 2 x 2"));
  EXPECT_EQ(folder_.entries(), 0U);
}

TEST_F(DepthPng, OtherFormatsAreNamed) {
  EXPECT_THAT(refusal(""), EndsWith("left.png: empty, must be a PNG file"));
  EXPECT_THAT(refusal("\xFF\xD8\xFF\xE0 JFIF"), EndsWith("left.png: not a PNG file"));
  EXPECT_THAT(refusal(png_begin(kWidth, kHeight, 8, 0)), EndsWith("left.png: 8 bits a pixel, must be 16-bit grey"));
  EXPECT_THAT(refusal(png_begin(kWidth, kHeight, 16, 2)), EndsWith(": colour, must be 16-bit grey"));
  EXPECT_THAT(refusal(png_begin(kWidth, kHeight, 8, 3)), EndsWith(": a palette, must be 16-bit grey"));
  EXPECT_THAT(refusal(png_begin(kWidth, kHeight, 16, 4)), EndsWith(": grey with alpha, must be 16-bit grey"));
  EXPECT_THAT(refusal(png_begin(kWidth, kHeight, 16, 9)), EndsWith(": colour type 9, must be 16-bit grey"));
  EXPECT_THAT(refusal(png_begin(kWidth, kHeight, 16, 0, 1)), EndsWith(": interlaced, must not be"));
}

TEST_F(DepthPng, OtherSizesAreNamedWhateverTheyPromise) {
  EXPECT_THAT(refusal(png_begin(48, 32, 16, 0)), EndsWith(": 48 x 32 pixels, must be 24 x 16 as its camera has"));
  EXPECT_THAT(refusal(png_begin(0x7FFFFFFF, 0x7FFFFFFF, 16, 0)),
              EndsWith(": 2147483647 x 2147483647 pixels, must be 24 x 16 as its camera has"));
  EXPECT_THAT(refusal(png_begin(0, 0, 16, 0)), HasSubstr(": 0 x 0 pixels"));
}

TEST_F(DepthPng, ACutFileIsRefusedWhereverItIsCut) {
  const std::string bytes = good();
  for (std::size_t length = 8; length < bytes.size(); ++length) {
    write_bytes(path_, bytes.substr(0, length));
    EXPECT_THAT(message_of<InputError>([&] { check_depth_png(path_, kWidth, kHeight); }), EndsWith("left.png: cut off"))
        << length;
    EXPECT_THAT(message_of<InputError>([&] { read(); }), EndsWith("cut off")) << length;
  }
}

TEST_F(DepthPng, ABitThatIsChangedIsFoundWhereverItIs) {
  const std::string bytes = good();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string changed = bytes;
    changed[i] = static_cast<char>(changed[i] ^ (1 << i % 8));
    write_bytes(path_, changed);
    EXPECT_THROW(read(), InputError) << i;
  }
}

TEST_F(DepthPng, RowsThatAreMissingAreFound) {
  const std::string row(1 + 2 * kWidth, '\0');
  std::string rows;
  for (int i = 0; i + 1 < kHeight; ++i) rows += row;
  const std::string begin = png_begin(kWidth, kHeight, 16, 0);
  const std::string end = png_chunk("IEND", "");
  EXPECT_THAT(damage(begin + png_chunk("IDAT", zlib_packed(rows)) + end), HasSubstr("left.png: damaged: "));
  EXPECT_THAT(damage(begin + end), HasSubstr("left.png: damaged: "));
  write_bytes(path_, begin + png_chunk("IDAT", zlib_packed(rows + row)) + end);
  EXPECT_EQ(read().depth, std::vector<float>(kPixels, 0.0F));
}

TEST_F(DepthPng, ASecondHeaderIsRefused) {
  const std::string bytes = good();
  const std::string begin = png_begin(kWidth, kHeight, 16, 0);
  const std::string large = png_begin(40000, 40000, 16, 0).substr(8);
  EXPECT_THAT(damage(begin + large + bytes.substr(begin.size())), HasSubstr("left.png: damaged: "));
}

TEST_F(DepthPng, RowsBeyondTheLastAreNotKeptAndNotEndless) {
  const auto with = [&](const std::string& rows) {
    return png_begin(kWidth, kHeight, 16, 0) + png_chunk("IDAT", zlib_packed(rows)) + png_chunk("IEND", "");
  };
  write_bytes(path_, with(std::string(std::size_t{32} << 20U, '\0')));
  EXPECT_EQ(read().depth, std::vector<float>(kPixels, 0.0F));
  std::string rows(2 * kPixels + kHeight, '\0');
  std::mt19937 random(1);
  for (int i = 0; i < 600'000; ++i) rows += static_cast<char>(random());
  write_bytes(path_, with(rows));
  EXPECT_EQ(read().depth, std::vector<float>(kPixels, 0.0F));
}

TEST_F(DepthPng, ALongFileIsRefused) {
  EXPECT_THAT(refusal(good() + std::string(std::size_t{2} << 20U, 'x')),
              HasSubstr("left.png: too long, must be at most"));
}

}  // namespace touchfield::depth_png_test
