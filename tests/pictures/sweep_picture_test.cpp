#include "sim/pictures/sweep_picture.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/pictures/picture_parts.h"
#include "tests/support/error_support.h"
#include "tests/support/output_support.h"
#include "tests/support/picture_support.h"

namespace touchfield {
namespace {

using support::has_colour;
using support::message_of;
using support::Picture;
using support::read_bytes;
using support::TemporaryDirectory;
using ::testing::HasSubstr;
using ::testing::StartsWith;

SweepRecord record(int number, const std::vector<std::pair<std::string, std::string>>& inputs, double error) {
  SweepRecord made;
  made.number = number;
  made.inputs = inputs;
  made.status = "ok";
  for (const char* name : {"paper", "focus"}) {
    SweepRecord::Method method{name, name, "chief", "converged", {}};
    method.metrics.relative_error = error + (made.methods.empty() ? 0.0 : 0.2);
    made.methods.push_back(method);
  }
  return made;
}

SweepSummary summary_of(const std::vector<std::string>& parameters, const std::vector<SweepRecord>& records) {
  SweepSummary summary;
  summary.name = "height";
  summary.cases = static_cast<int>(records.size());
  summary.parameters = parameters;
  summary.records = records;
  return summary;
}

int pixels_of(const Picture& picture, const Colour& colour) {
  int count = 0;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      count += has_colour(picture.at(x, y), colour) ? 1 : 0;
    }
  }
  return count;
}

TEST(SweepPicture, OneParameterGivesALineAMethod) {
  const TemporaryDirectory directory;
  const SweepSummary sweep =
      summary_of({"z"}, {record(1, {{"z", "10"}}, 0.3), record(2, {{"z", "20"}}, 0.4), record(3, {{"z", "30"}}, 0.5)});
  ASSERT_TRUE(draw_sweep(directory.file("sweep.png"), sweep, "relative_error", PictureFormat::kPng));
  EXPECT_EQ(directory.entries(), 1U);
  const Picture picture(directory.file("sweep.png"));
  EXPECT_EQ(picture.text("Description"), "height");
  // Four markers a method, one of them in the legend, each larger than 100 pixels.
  EXPECT_GT(pixels_of(picture, marker_colour(0)), 400);
  EXPECT_GT(pixels_of(picture, marker_colour(1)), 400);
  EXPECT_LT(pixels_of(picture, marker_colour(2)), 5);
  ASSERT_TRUE(draw_sweep(directory.file("sweep.pdf"), sweep, "relative_error", PictureFormat::kPdf));
  EXPECT_THAT(read_bytes(directory.file("sweep.pdf")), StartsWith("%PDF-"));
}

TEST(SweepPicture, ValuesThatDifferByRoundingAreDrawn) {
  const TemporaryDirectory directory;
  for (const double least : {0x1.73fad0088b45dp-1, 0.5, 0.7}) {
    std::vector<SweepRecord> line;
    std::vector<SweepRecord> map;
    for (int i = 0; i < 4; ++i) {
      const double error = i == 0 ? std::nextafter(least, 1.0) : least;
      line.push_back(record(i + 1, {{"z", std::to_string(i)}}, error));
      map.push_back(record(i + 1, {{"x", std::to_string(i / 2)}, {"y", std::to_string(i % 2)}}, error));
      line.back().methods.pop_back();
      map.back().methods.pop_back();
    }
    EXPECT_TRUE(draw_sweep(directory.file("line.png"), summary_of({"z"}, line), "relative_error", PictureFormat::kPng));
    EXPECT_TRUE(
        draw_sweep(directory.file("map.png"), summary_of({"x", "y"}, map), "relative_error", PictureFormat::kPng));
  }
}

TEST(SweepPicture, TwoParametersGiveAMapAMethod) {
  const TemporaryDirectory directory;
  std::vector<SweepRecord> records;
  for (const int x : {0, 1}) {
    for (const int y : {0, 1}) {
      const double error = 0.1 + 0.3 * x + 0.5 * y;  // 0.1 to 0.9, and 0.2 more
      records.push_back(
          record(static_cast<int>(records.size()) + 1, {{"x", std::to_string(x)}, {"y", std::to_string(y)}}, error));
    }
  }
  ASSERT_TRUE(
      draw_sweep(directory.file("sweep.png"), summary_of({"x", "y"}, records), "relative_error", PictureFormat::kPng));
  const Picture picture(directory.file("sweep.png"));
  // A quarter of a panel of 410 x 620 pixels has each value's colour.
  for (const double value : {0.0, 0.2, 0.3, 0.5, 0.7, 0.8, 1.0}) {
    EXPECT_GT(pixels_of(picture, viridis(value)), 60'000) << value;
  }
}

TEST(SweepPicture, WithoutAParameterOrAMetricThereIsNone) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("sweep.png");
  const SweepSummary same = summary_of({"z"}, {record(1, {{"z", "10"}}, 0.3), record(2, {{"z", "10"}}, 0.4)});
  EXPECT_FALSE(draw_sweep(path, same, "relative_error", PictureFormat::kPng));
  const SweepSummary words = summary_of({"z"}, {record(1, {{"z", "a"}}, 0.3), record(2, {{"z", "b"}}, 0.4)});
  EXPECT_FALSE(draw_sweep(path, words, "relative_error", PictureFormat::kPng));
  EXPECT_THAT(message_of<InputError>([&] { draw_sweep(path, words, "beauty", PictureFormat::kPng); }),
              HasSubstr("beauty"));
  EXPECT_EQ(directory.entries(), 0U);
}

}  // namespace
}  // namespace touchfield
