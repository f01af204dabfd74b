#include "sim/pictures/plots.h"
#include "tests/support/files.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::sweep_picture_test {

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
    for (int x = 0; x < picture.width(); ++x) count += has_colour(picture.at(x, y), colour) ? 1 : 0;
  }
  return count;
}

TEST(SweepPicture, OneParameterGivesALineAMethod) {
  const TemporaryDirectory directory;
  const SweepSummary sweep =
      summary_of({"z"}, {record(1, {{"z", "10"}}, 0.3), record(2, {{"z", "20"}}, 0.4), record(3, {{"z", "30"}}, 0.5)});
  ASSERT_EQ(draw_sweep(directory.file("sweep.png"), sweep, "relative_error"), "");
  EXPECT_EQ(directory.entries(), 1U);
  const Picture picture(directory.file("sweep.png"));
  EXPECT_EQ(picture.text("Description"), "height");
  // Four markers a method, one of them in the legend, each larger than 100 pixels.
  EXPECT_GT(pixels_of(picture, line_colour(0)), 400);
  EXPECT_GT(pixels_of(picture, line_colour(1)), 400);
  EXPECT_LT(pixels_of(picture, line_colour(2)), 5);
}

TEST(Plot, ValuesGiveALineAName) {
  const TemporaryDirectory directory;
  const auto plot = [&](const std::vector<LineValue>& values) {
    draw_plot(directory.file("plot.png"),
              {.texts = {.title = "a study"}, .panels = {{"error [%]", lines_through(values)}}});
    return Picture(directory.file("plot.png"));
  };
  const Picture picture =
      plot({{"chief", 1, 2}, {"chief", 2, 5}, {"paper", 1, 9}, {"paper", 1, 11}, {"paper", 2, NAN}});
  EXPECT_EQ(picture.width(), 1200);
  EXPECT_EQ(picture.height(), 900);
  EXPECT_EQ(picture.text("Description"), "a study");
  EXPECT_GT(pixels_of(picture, line_colour(0)), 300);
  EXPECT_GT(pixels_of(picture, line_colour(1)), 200);
  EXPECT_LT(pixels_of(picture, line_colour(2)), 5);
  EXPECT_LT(pixels_of(plot({}), line_colour(0)), 5);
  EXPECT_GT(pixels_of(plot({{"silence", 0, 0}}), line_colour(0)), 100);
}

TEST(Plot, PointsAreWhereTheyAreMeant) {
  const TemporaryDirectory directory;
  const PlotLine points{.label = "points", .points = {{2, 8, 8, 8}, {10, 10, 10, 10}}, .is_joined = false};
  const PlotLine same{.label = "equal", .points = {{0, 0, 0, 0}, {10, 10, 10, 10}}, .is_marked = false};
  draw_plot(directory.file("plot.png"), {.texts = {.title = "a scan"}, .panels = {{"measured", {points, same}}}});
  const Picture picture(directory.file("plot.png"));
  // The plot is 760 x 636 pixels from (120, 140) on; both axes go from 0 to 10.
  const auto at = [&](double x, double y) {
    return picture.at(static_cast<int>(120 + 76.0 * x), static_cast<int>(140 + 63.6 * y));
  };
  expect_colour(at(2, 8), line_colour(0));
  expect_colour(at(4, 4), line_colour(1));
  EXPECT_FALSE(has_colour(at(8, 2), line_colour(0)));
  EXPECT_FALSE(has_colour(at(6, 9), line_colour(0)));  // not joined
}

/// Cases of every value of a number with every one of another input; the error is first + second.
SweepSummary crossed(const std::string& second, const std::vector<std::pair<std::string, double>>& values) {
  std::vector<SweepRecord> records;
  for (const auto& [text, more] : values) {
    for (const int level : {1, 2, 3}) {
      records.push_back(record(static_cast<int>(records.size()) + 1,
                               {{second, text}, {"array.level", std::to_string(level)}}, 0.1 * level + more));
      records.back().methods.pop_back();
    }
  }
  return summary_of({second, "array.level"}, records);
}

TEST(SweepPicture, AnotherInputGivesALineForEachOfItsValues) {
  const TemporaryDirectory directory;
  const std::vector<std::pair<std::string, double>> sizes = {
      {"[5, 12, 6]", 0.0}, {"[8, 8, 6]", 0.1}, {"[11, 6, 6]", 0.2}, {"[14, 5, 6]", 0.3}};
  const std::string path = directory.file("sweep.png");
  ASSERT_EQ(draw_sweep(path, crossed("target.box.size_mm", sizes), "relative_error"), "");
  const Picture picture(path);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    EXPECT_GT(pixels_of(picture, line_colour(i)), 400) << i;  // a marker for each level and one in the legend
  }
  EXPECT_LT(pixels_of(picture, line_colour(4)), 5);
}

TEST(SweepPicture, SeedsAreAveragedAndTheirSpreadIsShown) {
  const TemporaryDirectory directory;
  const std::string one = directory.file("one.png");
  const std::string spread = directory.file("spread.png");
  ASSERT_EQ(draw_sweep(one, crossed("array.tolerances.seed", {{"1", 0.5}}), "relative_error"), "");
  ASSERT_EQ(draw_sweep(spread, crossed("array.tolerances.seed", {{"1", 0.0}, {"2", 1.0}}), "relative_error"), "");
  // One line through the same means, with a bar of some 400 x 3 pixels through each of its three points.
  EXPECT_GT(pixels_of(Picture(spread), line_colour(0)), pixels_of(Picture(one), line_colour(0)) + 600);
  EXPECT_LT(pixels_of(Picture(spread), line_colour(1)), 5);
  EXPECT_EQ(draw_sweep(one, crossed("array.tolerances.seed", {{"1", 0.1}, {"2", 0.1}}), "relative_error"), "");
}

TEST(SweepPicture, WhatCannotBeToldApartIsNotDrawn) {
  const TemporaryDirectory directory;
  const auto why = [&](int count) {
    std::vector<std::pair<std::string, double>> names;
    for (int i = 0; i < count; ++i) names.emplace_back("name_" + std::to_string(i), 0.01 * i);
    return draw_sweep(directory.file("sweep.png"), crossed("name", names), "relative_error");
  };
  EXPECT_EQ(why(12), "");
  EXPECT_EQ(why(13), "13 combinations of name are more than the 12 that a plot can show; sweep.csv has them");
  EXPECT_EQ(draw_sweep(directory.file("none.png"), summary_of({}, {record(1, {}, 0.1)}), "relative_error"),
            "no input is a number in every case, and differs");
}

}  // namespace touchfield::sweep_picture_test
