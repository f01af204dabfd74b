#include <cmath>

#include "sim/core/version.h"
#include "sim/pictures/study_picture.h"
#include "tests/support/files.h"
#include "tests/support/picture_support.h"
#include "tests/support/testing.h"

namespace touchfield::study_files_test {

StudyRung rung(double seconds, double error, const std::string& scheme = "chief", double edge_mm = 2.0) {
  StudyRung made;
  made.scheme = scheme;
  made.edge_mm = edge_mm;
  made.faces = 1234;
  made.precision = "double";
  made.solver = "LU";
  made.seconds = seconds;
  made.error_reference = error;
  return made;
}

StudyRung failed_rung() {
  StudyRung made = rung(kNotComputed, kNotComputed);
  made.status = "out of memory, 12 GiB";
  return made;
}

std::vector<bool> pareto_of(std::vector<StudyRung> rungs) {
  mark_pareto(rungs);
  std::vector<bool> marks;
  for (const StudyRung& one : rungs) {
    marks.push_back(one.pareto);
  }
  return marks;
}

TEST(StudyRungs, ParetoIsWhatNoOtherBeatsInBoth) {
  EXPECT_THAT(pareto_of({rung(1, 0.3), rung(2, 0.1), rung(3, 0.2), rung(2, 0.4), rung(9, 0.01)}),
              ElementsAre(true, true, false, false, true));
}

TEST(StudyRungs, EqualsDoNotBeatEachOtherButEqualTimesWithLessErrorDo) {
  EXPECT_THAT(pareto_of({rung(1, 0.1), rung(1, 0.1), rung(1, 0.2), rung(2, 0.1)}),
              ElementsAre(true, true, false, false));
}

// A comparison with NaN is false: without care such a rung would be beaten by none.
TEST(StudyRungs, WithoutBothNumbersARungIsNeitherMarkedNorPicked) {
  const std::vector<StudyRung> rungs = {failed_rung(), rung(0.1, kNotComputed), rung(kNotComputed, 1e-9), rung(5, 0.5)};
  EXPECT_THAT(pareto_of(rungs), ElementsAre(false, false, false, true));
  EXPECT_EQ(pick_within_seconds(rungs, 10), 3U);
  EXPECT_EQ(pick_within_error(rungs, 1), 3U);
}

TEST(StudyRungs, AMarkOfBeforeIsTakenAway) {
  std::vector<StudyRung> rungs = {rung(1, 0.1), rung(2, 0.2), failed_rung()};
  for (StudyRung& one : rungs) {
    one.pareto = true;
  }
  EXPECT_THAT(pareto_of(rungs), ElementsAre(true, false, false));
}

TEST(StudyRungs, PicksKeepWithinTheirLimit) {
  const std::vector<StudyRung> rungs = {rung(1, 0.3), rung(4, 0.1), rung(3, 0.1), rung(9, 0.01), rung(3, 0.2)};
  EXPECT_EQ(pick_within_seconds(rungs, 4), 2U);  // as exact as the rung of 4 s, and faster
  EXPECT_EQ(pick_within_seconds(rungs, 1), 0U);
  EXPECT_EQ(pick_within_seconds(rungs, 1e9), 3U);
  EXPECT_EQ(pick_within_seconds(rungs, 0.99), std::nullopt);
  EXPECT_EQ(pick_within_error(rungs, 0.2), 2U);  // as fast as the rung of 20 %, and more exact
  EXPECT_EQ(pick_within_error(rungs, 0.3), 0U);
  EXPECT_EQ(pick_within_error(rungs, 0.01), 3U);
  EXPECT_EQ(pick_within_error(rungs, 0.0099), std::nullopt);
  EXPECT_EQ(pick_within_error({}, 1), std::nullopt);
}

TEST(StudyCsv, IsOneLineARung) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("study.csv");
  std::vector<StudyRung> rungs = {rung(1.0 / 3.0, 0.015625), failed_rung()};
  rungs[0].solver = "GMRES, matrix-free";
  rungs[0].peak_mib = 1536;
  rungs[0].error_interior = 1e-5;
  rungs[0].pattern_error = 0.25;
  mark_pareto(rungs);
  write_study_csv(path, rungs);
  EXPECT_EQ(read_bytes(path),
            "scheme,edge_mm,faces,precision,solver,seconds,peak_mib,error_reference,error_interior,pattern_error,"
            "pareto,status\n"
            "chief,2,1234,double,\"GMRES, matrix-free\",0.3333333333333333,1536,0.015625,1e-05,0.25,1,ok\n"
            "chief,2,1234,double,LU,nan,nan,nan,nan,nan,0,\"out of memory, 12 GiB\"\n");
  EXPECT_EQ(directory.entries(), 1U);
  EXPECT_THROW(write_study_csv(directory.file("missing/study.csv"), rungs), IoError);
}

TEST(StudyTable, IsSortedBySchemeThenEdgeAndMarksTheBest) {
  std::vector<StudyRung> rungs = {rung(5, 0.1, "other", 1), rung(4, 0.1, "burton_miller", 2), rung(1, 0.2, "paper", 3),
                                  rung(2, 0.3, "paper", 1.5), failed_rung()};
  rungs[4].scheme = "paper";
  rungs[4].edge_mm = kNotComputed;
  mark_pareto(rungs);
  EXPECT_EQ(
      study_table(rungs),
      "  scheme         edge [mm]  faces  precision  solver  seconds  peak [MiB]  error reference  error interior  "
      "pattern error  pareto  status\n"
      "  paper                1.5  1,234  double     LU            2           -             30 %               -  "
      "            -      no  ok\n"
      "  paper                  3  1,234  double     LU            1           -             20 %               -  "
      "            -     yes  ok\n"
      "  paper                  -  1,234  double     LU            -           -                -               -  "
      "            -      no  out of memory, 12 GiB\n"
      "  burton_miller          2  1,234  double     LU            4           -             10 %               -  "
      "            -     yes  ok\n"
      "  other                  1  1,234  double     LU            5           -             10 %               -  "
      "            -      no  ok\n"
      "  pareto: no other is both faster and more accurate\n");
}

constexpr int kLegendBegins = 880;  // [pixels]
constexpr Colour kPaperColour = {213, 94, 0};
constexpr Colour kChiefColour = {0, 158, 115};
constexpr Colour kBurtonMillerColour = {86, 180, 233};

/// Mean place of the pixels of a colour in the plot, or in the legend; NaN if there is none.
Eigen::Vector2d middle_of(const Picture& picture, const Colour& colour, bool in_legend = false) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = in_legend ? kLegendBegins : 0; x < (in_legend ? picture.width() : kLegendBegins); ++x) {
      if (has_colour(picture.at(x, y), colour)) {
        sum += Eigen::Vector2d(x + 0.5, y + 0.5);
        ++count;
      }
    }
  }
  return sum / count;
}

// Equal ratios are equal distances. Markers are cut at pixels, so their middles are known to about one.
TEST(StudyPicture, BothAxesAreLogarithmic) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("study.png");
  const std::vector<StudyRung> rungs = {rung(0.02, 0.3, "paper"), rung(0.2, 0.03, "chief"),
                                        rung(2, 0.003, "burton_miller")};
  draw_study(path, "a study", rungs, std::nullopt, PictureFormat::kPng);
  EXPECT_EQ(directory.entries(), 1U);
  const Picture picture(path);
  ASSERT_EQ(picture.width(), 1200);
  ASSERT_EQ(picture.height(), 900);
  EXPECT_EQ(picture.text("Description"), "a study");
  EXPECT_EQ(picture.text("Software"), "touchfield " + build_info().version);
  EXPECT_EQ(picture.text("Source"), build_info().revision);
  const Eigen::Vector2d first = middle_of(picture, kPaperColour);
  const Eigen::Vector2d second = middle_of(picture, kChiefColour);
  const Eigen::Vector2d third = middle_of(picture, kBurtonMillerColour);
  EXPECT_GT(second.x(), first.x() + 100);
  EXPECT_LT(second.y(), first.y() - 100);
  EXPECT_NEAR(third.x() - second.x(), second.x() - first.x(), 3.0);
  EXPECT_NEAR(third.y() - second.y(), second.y() - first.y(), 3.0);
  // The legend has those that are drawn, the cheapest scheme first.
  EXPECT_GT(middle_of(picture, kPaperColour, true).y(), middle_of(picture, kChiefColour, true).y());
  EXPECT_TRUE(std::isnan(middle_of(picture, {230, 159, 0}, true).x())) << "paper_corrected";
}

TEST(StudyPicture, TheBestAreJoinedAndThePickedOneHasARing) {
  const TemporaryDirectory directory;
  std::vector<StudyRung> rungs = {rung(0.02, 0.3, "paper"), rung(0.2, 0.03, "chief"), rung(2, 0.1, "burton_miller")};
  draw_study(directory.file("plain.png"), "", rungs, std::nullopt, PictureFormat::kPng);
  mark_pareto(rungs);
  draw_study(directory.file("marked.png"), "", rungs, 1, PictureFormat::kPng);
  const Picture plain(directory.file("plain.png"));
  const Picture marked(directory.file("marked.png"));
  const Eigen::Vector2d first = middle_of(plain, kPaperColour);
  const Eigen::Vector2d second = middle_of(plain, kChiefColour);
  const auto darkest = [](const Picture& picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    int least = 255;
    for (double t = 0; t <= 1; t += 0.02) {
      least = std::min<int>(least, picture.at(from + t * (to - from))[0]);
    }
    return least;
  };
  // Across the line halfway between the two, and from outside the ring into it on the side away from the line.
  const Eigen::Vector2d halfway = 0.5 * (first + second);
  const Eigen::Vector2d across(5, 5);
  EXPECT_GT(darkest(plain, halfway - across, halfway + across), 180);
  EXPECT_LT(darkest(marked, halfway - across, halfway + across), 120);
  const Eigen::Vector2d away = (second - first).normalized();
  EXPECT_GT(darkest(plain, second + 14 * away, second + 24 * away), 180);
  EXPECT_LT(darkest(marked, second + 14 * away, second + 24 * away), 120);
}

TEST(StudyPicture, WhatALogarithmHasNoPlaceForIsLeftOut) {
  const TemporaryDirectory directory;
  const std::vector<StudyRung> rungs = {failed_rung(), rung(1, 0), rung(0, 1), rung(HUGE_VAL, 1)};
  const auto drawn = [&](const std::vector<StudyRung>& all, const std::optional<std::size_t>& picked) {
    draw_study(directory.file("study.png"), "nothing", all, picked, PictureFormat::kPng);
    return Picture(directory.file("study.png"));
  };
  const Picture plain = drawn(rungs, std::nullopt);
  const auto same = [&](const Picture& picture) {
    for (int y = 0; y < plain.height(); ++y) {
      for (int x = 0; x < plain.width(); ++x) {
        if (!has_colour(picture.at(x, y), plain.at(x, y))) {
          return false;
        }
      }
    }
    return true;
  };
  for (std::size_t picked = 0; picked < rungs.size(); ++picked) {
    SCOPED_TRACE(picked);
    const Picture picture = drawn(rungs, picked);  // the ring round the picked one has no place either
    EXPECT_TRUE(std::isnan(middle_of(picture, kChiefColour).x()));
    EXPECT_TRUE(std::isnan(middle_of(picture, kChiefColour, true).x())) << "legend";
    EXPECT_TRUE(same(picture));
  }
  EXPECT_TRUE(std::isnan(middle_of(drawn({}, std::nullopt), kChiefColour).x())) << "no rung at all";
  EXPECT_FALSE(same(drawn({rung(1, 1)}, 0))) << "or the comparison would say nothing";
}

TEST(StudyPicture, AMissingDirectoryIsAnIoError) {
  const TemporaryDirectory directory;
  EXPECT_THAT(message_of<IoError>(
                  [&] { draw_study(directory.file("missing/study.png"), "", {rung(1, 1)}, 0, PictureFormat::kPng); }),
              HasSubstr("missing/study.png"));
}

}  // namespace touchfield::study_files_test
