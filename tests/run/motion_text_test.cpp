#include "sim/run/motion_summary.h"
#include "tests/support/files.h"
#include "tests/support/motion_support.h"
#include "tests/support/testing.h"

namespace touchfield::motion_text_test {

/// Lines of a CSV file without quotes, split at commas.
std::vector<std::vector<std::string>> cells_of(const std::string& path) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(read_bytes(path));
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string>& row = rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
  }
  return rows;
}

TEST(MotionCsv, HasALineAScoreAndMethod) {
  const TemporaryDirectory directory;
  const Motion motion = full_motion();
  write_motion_csv(directory.file("motion.csv"), motion);
  const auto rows = cells_of(directory.file("motion.csv"));
  ASSERT_EQ(rows.size(), 1 + 2 * 6U);
  for (const auto& row : rows) ASSERT_EQ(row.size(), 8 + metric_fields().size());
  EXPECT_THAT(std::vector<std::string>(rows[0].begin(), rows[0].begin() + 9),
              ElementsAre("method", "time_s", "frame", "age_s", "dx_mm", "dy_mm", "dz_mm", "displacement_mm",
                          "relative_error"));
  EXPECT_THAT(std::vector<std::string>(rows[1].begin(), rows[1].begin() + 9),
              ElementsAre("surface", "0", "-1", "nan", "nan", "nan", "nan", "nan", "nan"));
  const MotionScore& score = motion.methods[1].scores[5];
  const auto& last = rows.back();
  EXPECT_EQ(last[0], "paper-2");
  EXPECT_EQ(last[2], "3");
  const auto number = [&](std::size_t i) { return std::stod(last[i]); };
  EXPECT_EQ(number(1), score.time);
  EXPECT_EQ(number(3), score.age);
  EXPECT_DOUBLE_EQ(number(4), 1.0 / 3);
  EXPECT_DOUBLE_EQ(number(5), -2.0);
  EXPECT_DOUBLE_EQ(number(6), 0.5);
  EXPECT_DOUBLE_EQ(number(7), std::sqrt(1.0 / 9 + 4 + 0.25));
  EXPECT_EQ(number(8), score.metrics.relative_error);
}

TEST(FramesCsv, HasALineAFrameAndMethod) {
  const TemporaryDirectory directory;
  write_frames_csv(directory.file("frames.csv"), full_motion());
  const auto rows = cells_of(directory.file("frames.csv"));
  ASSERT_EQ(rows.size(), 1 + 2 * 4U);
  EXPECT_THAT(rows[0], ElementsAre("method", "frame", "sampled_s", "started_s", "late_s", "shown_s", "pose_time_s",
                                   "silent", "lost", "skin_off_mm", "patch_off_mm", "target_off_mm", "cost", "steps",
                                   "status", "seconds_pose", "seconds_factorisation"));
  EXPECT_THAT(rows[3], ElementsAre("surface", "2", testing::_, "0.101", "0.004", testing::_, testing::_, "0", "0",
                                   "0.3", "nan", "0.7", "0.2", "2", "iteration_limit", testing::_, "0.012"));
  const auto& silent = rows[6];
  EXPECT_EQ(silent[7], "1");
  EXPECT_EQ(silent[8], "1");
  EXPECT_EQ(silent[12], "nan");
  EXPECT_EQ(silent[14], "direct");
  EXPECT_EQ(silent[16], "nan");
}

// Of the second method: errors 0.575, 0.675, 0.775, 0.875 (and two NaN), levels 1200 to 1500.
TEST(MotionSummary, IsThatOfTheScoresAndFrames) {
  const MotionSummary over = summary(full_motion().methods[1]);
  EXPECT_EQ(over.frames, 4);
  EXPECT_EQ(over.silent, 1);
  EXPECT_EQ(over.lost, 1);
  EXPECT_EQ(over.late, 1);
  EXPECT_EQ(over.dropped, 3);
  EXPECT_EQ(over.scores, 6);
  const Statistics& error = statistics_of(over, &Metrics::relative_error);
  EXPECT_EQ(error.count, 4);
  EXPECT_DOUBLE_EQ(error.mean, 0.725);
  EXPECT_DOUBLE_EQ(error.median, 0.725);
  EXPECT_DOUBLE_EQ(error.p95, 0.86);  // place 2.85
  EXPECT_DOUBLE_EQ(error.worst, 0.875);
  EXPECT_DOUBLE_EQ(statistics_of(over, &Metrics::mean_inside_pa).worst, 1200.0);  // more is better
  EXPECT_EQ(statistics_of(over, &Metrics::leakage).count, 0);
  EXPECT_TRUE(std::isnan(statistics_of(over, &Metrics::leakage).worst));
  EXPECT_EQ(over.displacement.count, 4);  // not of scores before the first frame
  EXPECT_DOUBLE_EQ(over.displacement.worst, std::sqrt(1.0 / 9 + 4 + 0.25) * 1e-3);
  EXPECT_DOUBLE_EQ(over.age.median, 0.02 + 3.5e-3 / 3);
  EXPECT_EQ(over.latency.count, 4);
  EXPECT_NEAR(over.latency.worst, 3 / 20.0 + 0.022 - 3 / 30.0, 1e-15);
  EXPECT_EQ(over.frame_seconds.count, 3);
  EXPECT_DOUBLE_EQ(over.frame_seconds.median, 1e-3 / 3 + 0.012);
}

}  // namespace touchfield::motion_text_test
