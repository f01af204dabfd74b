#include <numbers>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/scene/number_files.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

using support::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using testing::kSmallScene;
using testing::problems_of;
using testing::TempFolder;

/// A scene over 2 x 2 channels with more keys of its array.
std::string scene_with(const std::string& keys) {
  std::string text = kSmallScene;
  const std::string array = "{grid: {}}";
  return text.replace(text.find(array), array.size(), "{grid: {count: [2, 2]}, " + keys + "}");
}

ArraySpec array_of(const std::string& keys, const std::string& table = "") {
  const TempFolder folder;
  folder.write("cal.csv", table);
  return read_scene(folder.write("s.yaml", scene_with(keys))).array;
}

const std::string kTable =
    "# measured in a box\n"
    "gain, channel, phase_deg, alive\n"
    "0.9, 2, -90, 1\n"
    "1.1, 0, 180, 1\n"
    "\n"
    "1, 1, 0, 0   # mute\n"
    "1, 3, 0, 1\n";

TEST(Calibration, IsReadInAnyOrderOfRowsAndColumns) {
  const ArraySpec array = array_of("calibration: {file: cal.csv}", kTable);
  EXPECT_THAT(array.calibration->gain, ElementsAre(1.1, 0.0, 0.9, 1.0));
  EXPECT_THAT(array.calibration->phase, ElementsAre(std::numbers::pi, 0.0, -std::numbers::pi / 2, 0.0));
  const ArraySpec radians =
      array_of("calibration: {file: cal.csv}", "channel,gain,phase_rad\n0,1,0.5\n1,1,0\n2,1,0\n3,1,0\n");
  EXPECT_EQ(radians.calibration->phase.front(), 0.5);
}

TEST(Calibration, IsOfBothArraysUnlessTheSceneSays) {
  EXPECT_FALSE(solver_mistakes_channels(array_of("calibration: {file: cal.csv}", kTable)));
  for (const bool solver : {true, false}) {
    const ArraySpec array =
        array_of(fmt::format("calibration: {{file: cal.csv, in: {}}}", solver ? "solver" : "truth"), kTable);
    EXPECT_TRUE(solver_mistakes_channels(array));
    const ChannelResponses responses = channel_responses(array);
    EXPECT_EQ(responses.solver.as_designed(), !solver);
    EXPECT_EQ(responses.truth.as_designed(), solver);
  }
}

TEST(Calibration, AndSpreadMultiply) {
  const ArraySpec array =
      array_of("calibration: {file: cal.csv}, tolerances: {gain_percent: 10, phase_deg: 5, seed: 4}", kTable);
  const ChannelResponse drawn = random_response(4, *array.tolerances, array.tolerances->seed);
  const ChannelResponses responses = channel_responses(array);
  EXPECT_NEAR(responses.solver.gain(2), 0.9, 1e-15);  // tolerances are of the truth alone unless the scene says
  EXPECT_NEAR(responses.truth.gain(2), 0.9 * drawn.gain(2), 1e-15);
  EXPECT_NEAR(responses.truth.phase(0), std::numbers::pi + drawn.phase(0), 1e-15);
  EXPECT_EQ(responses.truth.gain(1), 0.0);
}

TEST(Calibration, TheResolvedSceneHoldsItsNumbers) {
  const TempFolder folder;
  folder.write("cal.csv", kTable);
  const Scene scene = read_scene(folder.write(
      "s.yaml", scene_with("calibration: {file: cal.csv, in: truth}, phase_levels: 16, "
                           "tolerances: {gain_percent: 5, phase_deg: 10, dead_percent: 1, seed: 7, in: both}")));
  const std::string resolved = resolved_yaml(scene);
  EXPECT_THAT(resolved, HasSubstr("gain: [1.1, 0, 0.9, 1]"));
  const Scene again = read_scene_text(resolved, "resolved", "/nowhere");
  EXPECT_EQ(again.array.calibration->gain, scene.array.calibration->gain);
  EXPECT_EQ(again.array.calibration->phase, scene.array.calibration->phase);
  EXPECT_EQ(again.array.calibration->in, ResponseOf::kTruth);
  EXPECT_EQ(again.array.tolerances->gain, 0.05);
  EXPECT_EQ(again.array.tolerances->dead, 0.01);
  EXPECT_EQ(again.array.tolerances->seed, 7U);
  EXPECT_EQ(again.array.tolerances->in, ResponseOf::kBoth);
  EXPECT_EQ(again.array.phase_levels, 16);
  EXPECT_EQ(resolved_yaml(again), resolved);
}

TEST(Calibration, ATableThatIsNotAsDocumentedIsRefused) {
  const std::string head = "channel,gain,phase_rad\n";
  const std::pair<std::string, const char*> table[] = {
      {head + "0,1,0\n1,1,0\n3,1,0\n", "cal.csv: channel 2 is missing; the array has 4 channels"},
      {head + "0,1,0\n1,1,0\n2,1,0\n3,1,0\n4,1,0\n",
       "cal.csv:6: channel = 4 must be an integer from 0 to 3, the array has 4 channels"},
      {head + "0,1,0\n1.5,1,0\n", "cal.csv:3: channel = 1.5 must be an integer from 0 to 3"},
      {head + "0,1,0\n0,1,0\n", "cal.csv:3: channel = 0 is in line 2 already"},
      {head + "0,nan,0\n", "cal.csv:2: gain = nan must be a number"},
      {head + "0,-0.1,0\n", "cal.csv:2: gain = -0.1 must be 0 to 10"},
      {head + "0,98,0\n", "cal.csv:2: gain = 98 must be 0 to 10; if 98 is in percent write 0.98"},
      {head + "0,1,inf\n", "cal.csv:2: phase_rad = inf must be a number"},
      {head + "0,1\n", "cal.csv:2: 2 values, must be 3 as in the header"},
      {"channel,gain,phase_rad,alive\n0,1,0,0.5\n", "cal.csv:2: alive = 0.5 must be 0 or 1"},
      {"channel,gain\n0,1\n", "cal.csv: the header must name phase_rad or phase_deg, one of them"},
      {"channel,gain,phase_rad,phase_deg\n0,1,0,0\n", "cal.csv: the header must name phase_rad or phase_deg"},
      {"0,1,0\n", "cal.csv:1: column '0' must be one of channel, gain,"},
      {"channel,gain,phase\n0,1,0\n", "cal.csv:1: column 'phase' must be one of channel, gain,"},
      {"channel,phase_rad\n0,1\n", "cal.csv:1: the header must name gain"},
      {"channel,gain,gain\n", "cal.csv:1: column gain is there twice"},
      {"# nothing\n", "cal.csv: no channels in it, must hold at least one"},
  };
  const TempFolder folder;
  const std::string scene = folder.write("s.yaml", scene_with("calibration: {file: cal.csv}"));
  for (const auto& [text, phrase] : table) {
    folder.write("cal.csv", text);
    EXPECT_THAT(problems_of(scene), ElementsAre(AllOf(HasSubstr("array.calibration.file: "), HasSubstr(phrase))))
        << text;
  }
}

TEST(Calibration, WhatTheSceneListsItselfFitsTheChannels) {
  const TempFolder folder;
  const auto said = [&](const std::string& keys) { return problems_of(folder.write("s.yaml", scene_with(keys))); };
  EXPECT_THAT(said("calibration: {gain: [1, 0, 1, 1], phase_rad: [0, 0, 0, 0]}"), ElementsAre());
  EXPECT_THAT(said("calibration: {gain: [1, 0, 1], phase_rad: [0, 0, 0, 0]}"),
              ElementsAre(EndsWith("array.calibration.gain: 3 values, must be 4: one per channel")));
  EXPECT_THAT(said("calibration: {gain: [1, 0, 1, 1]}"), ElementsAre(HasSubstr("phase_rad")));
  EXPECT_THAT(said("calibration: {gain: [1, 0, -1, 1], phase_rad: [0, 0, 0, 0]}"),
              ElementsAre(EndsWith("array.calibration.gain[2] = -1 must be 0 to 10")));
  EXPECT_THAT(said("calibration: {file: none.csv}"), ElementsAre(HasSubstr("none.csv")));
}

TEST(Calibration, ATruthTheSolverDoesNotKnowNeedsAnEvaluation) {
  const TempFolder folder;
  for (const char* keys : {"tolerances: {gain_percent: 5}", "phase_levels: 16"}) {
    EXPECT_THAT(problems_of(folder.write("s.yaml", scene_with(keys) + "evaluation: none\n")),
                ElementsAre(HasSubstr("evaluation: none, but the solver does not know")));
  }
  EXPECT_THAT(
      problems_of(folder.write("s.yaml", scene_with("tolerances: {gain_percent: 5, in: both}") + "evaluation: none\n")),
      ElementsAre());
}

TEST(MeasuredPoints, AreMagnitudesOrComplex) {
  const TempFolder folder;
  const MeasuredPoints plain =
      read_measured_points(folder.write("a.csv", "x_mm,y_mm,z_mm,p_pa\n1,-2,150,3\n\n0,0,160,4 # far\n"));
  EXPECT_FALSE(plain.complex);
  EXPECT_EQ(plain.points.col(0), Vector3(1e-3, -2e-3, 0.15));
  EXPECT_EQ(plain.pressure(1), Complex(4.0));
  EXPECT_THAT(plain.lines, ElementsAre(2, 4));
  const MeasuredPoints turned = read_measured_points(folder.write("b.csv", "p_im,p_re,x_mm,y_mm,z_mm\n1,2,0,0,5\n"));
  EXPECT_TRUE(turned.complex);
  EXPECT_EQ(turned.pressure(0), Complex(2, 1));
}

TEST(MeasuredPoints, ATableThatIsNotAsDocumentedIsRefused) {
  const std::pair<const char*, const char*> table[] = {
      {"x_mm,y_mm,z_mm,p_pa\n0,0,1,x\n", "m.csv:2: p_pa = x must be a number"},
      {"x_mm,y_mm,z_mm,p_pa\n0,0,1,1\n0,0,1,-1\n", "m.csv:3: p_pa = -1 must be >= 0"},
      {"x_mm,y_mm,p_pa\n", "m.csv:1: the header must name z_mm"},
      {"x,y_mm,z_mm,p_pa\n1,2,3,9\n", "m.csv:1: column 'x' must be one of x_mm"},
      {"x_mm,y_mm,z_mm\n0,0,1\n", "m.csv: the header must name p_pa, or p_re and p_im"},
      {"x_mm,y_mm,z_mm,p_re\n0,0,1,2\n", "m.csv: the header must name p_pa, or p_re and p_im"},
      {"x_mm,y_mm,z_mm,p_pa,p_re,p_im\n0,0,1,2,3,4\n", "m.csv: the header must name p_pa, or p_re and p_im"},
  };
  const TempFolder folder;
  for (const auto& [text, phrase] : table) {
    EXPECT_THAT(message_of<InputError>([&] { read_measured_points(folder.write("m.csv", text)); }), HasSubstr(phrase));
  }
}

}  // namespace
}  // namespace touchfield
