#include "sim/scene/number_files.h"

#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

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

TEST(Calibration, ATableThatIsNotAsDocumentedIsRefused) {
  const std::string head = "channel,gain,phase_rad\n";
  const std::pair<std::string, const char*> table[] = {
      {head + "0,1,0\n1,1,0\n3,1,0\n", "cal.csv: channel 2 is missing; the array has 4 channels"},
      {head + "0,1,0\n1,1,0\n2,1,0\n3,1,0\n4,1,0\n",
       "cal.csv:6: channel = 4 must be an integer from 0 to 3, the array has 4 channels"},
      {head + "0,1,0\n1.5,1,0\n", "cal.csv:3: channel = 1.5 must be an integer from 0 to 3"},
      {head + "0,1,0\n0,1,0\n", "cal.csv:3: channel = 0 is in line 2 already"},
      {head + "0,98,0\n", "cal.csv:2: gain = 98 must be 0 to 10; if 98 is in percent write 0.98"},
      {head + "0,1,inf\n", "cal.csv:2: phase_rad = inf must be a number"},
      {"channel,gain,phase_rad,alive\n0,1,0,0.5\n", "cal.csv:2: alive = 0.5 must be 0 or 1"},
      {"channel,gain\n0,1\n", "cal.csv: the header must name phase_rad or phase_deg, one of them"},
      {"channel,phase_rad\n0,1\n", "cal.csv:1: the header must name gain"},
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
  const MeasuredPoints turned = read_measured_points(folder.write("b.csv", "p_im,p_re,x_m,y_mm,z_mm\n1,2,.001,0,5\n"));
  EXPECT_TRUE(turned.complex);
  EXPECT_EQ(turned.points.col(0), Vector3(1e-3, 0, 5e-3));
  EXPECT_EQ(turned.pressure(0), Complex(2, 1));
}

TEST(MeasuredPoints, ATableThatIsNotAsDocumentedIsRefused) {
  const std::pair<const char*, const char*> table[] = {
      {"x_mm,y_mm,z_mm,p_pa\n0,0,1,x\n", "m.csv:2: p_pa = x must be a number"},
      {"x_mm,y_mm,z_mm,p_pa\n0,0,1,1\n0,0,1,-1\n", "m.csv:3: p_pa = -1 must be >= 0"},
      {"x_mm,y_mm,p_pa\n", "m.csv:1: the header must name z_mm"},
      {"x_mm,y_mm,z_mm\n0,0,1\n", "m.csv: the header must name p_pa, or p_re and p_im"},
      {"x_mm,y_mm,z_mm,p_pa,p_re,p_im\n0,0,1,2,3,4\n", "m.csv: the header must name p_pa, or p_re and p_im"},
  };
  const TempFolder folder;
  for (const auto& [text, phrase] : table) {
    EXPECT_THAT(message_of<InputError>([&] { read_measured_points(folder.write("m.csv", text)); }), HasSubstr(phrase));
  }
}

schema::PositionsFile positions_of(const std::string& table) {
  const TempFolder folder;
  return schema::read_positions(folder.write("array.csv", table));
}

/// Transducers at (1, 2, 3) and (-4, 5, 6) mm.
Points two_points() {
  Points points(3, 2);
  points << 1e-3, -4e-3, 2e-3, 5e-3, 3e-3, 6e-3;
  return points;
}

TEST(Positions, OneArrayInEveryDocumentedHeaderIsTheSame) {
  for (const char* table : {
           "x_mm,y_mm,z_mm\n1,2,3\n-4,5,6\n",
           "x_m,y_m,z_m\n0.001,0.002,0.003\n-0.004,0.005,0.006\n",
           "x_um, y_m, z_cm # each in its own unit\n1000, 0.002, 0.3\n\n-4000, 0.005, 0.6 # the last\n",
           "z_mm,y_mm,x_mm\n3,2,1\n6,5,-4\n",
           "x_mm\ty_mm\tz_mm\n1\t2\t3\n-4\t5\t6\n",
           "# from the workshop\n# x_mm y_mm z_mm\n1.0e+00 2.0e+00 3.0e+00\n-4 5   6\n",  // as numpy.savetxt writes it
           "\xEF\xBB\xBFx_mm,y_mm,z_mm\r\n1,2,3\r\n-4,5,6\r\n",
           "id,x_mm,y_mm,z_mm\nT7,1,2,3\nT3,-4,5,6\n",
           ",x_mm,y_mm,z_mm\n0,1,2,3\n1,-4,5,6\n",  // as pandas writes it
           "channel,z_mm,name,y_mm,x_mm\n0,3,a,2,1\n1,6,b,5,-4\n",
       }) {
    EXPECT_EQ(positions_of(table).points, two_points()) << table;
  }
}

TEST(Positions, AxesAndZMayBeLeftOut) {
  Points flat = two_points();
  flat.row(2).setZero();
  EXPECT_EQ(positions_of("x_mm,y_mm\n1,2\n-4,5\n").points, flat);
  EXPECT_FALSE(positions_of("x_mm,y_mm\n1,2\n-4,5\n").axes);
  Points axes(3, 2);
  axes << 0, 5, 0, 0, -2, 0;
  EXPECT_EQ(positions_of("nz,ny,nx,x_mm,y_mm\n-2,0,0,1,2\n0,0,5,-4,5\n").axes, axes);
}

TEST(Positions, DeadTransducersAreACalibration) {
  for (const char* table : {"x_mm,y_mm,alive\n0,0,1\n10,0,0\n20,0,1\n", "x_mm,y_mm,dead\n0,0,0\n10,0,1\n20,0,0\n"}) {
    EXPECT_THAT(positions_of(table).dead, ElementsAre(1)) << table;
  }
  const TempFolder folder;
  folder.write("array.csv", "x_mm,y_mm,alive\n0,0,1\n10,0,0\n");
  const auto scene = [&](const std::string& more) {
    return folder.write("scene.yaml", "name: files\narray: {positions: {file: array.csv}" + more +
                                          "}\nbody: {sphere: {radius_mm: 8}, edge_mm: 2}\n"
                                          "solve: {methods: [{fixed: {phases_rad: 0}}]}\n");
  };
  const ArraySpec array = read_scene(scene(""), {}).array;
  ASSERT_TRUE(array.calibration);
  EXPECT_THAT(array.calibration->gain, ElementsAre(1, 0));
  EXPECT_EQ(std::get<PositionsArray>(array.layout).axes.col(1), Vector3(0, 0, 1));
  EXPECT_EQ(array.calibration->in, ResponseOf::kBoth);
  EXPECT_THAT(problems_of(scene(", calibration: {gain: [1], phase_rad: [0]}")),
              ElementsAre(HasSubstr("array.positions.file says which transducers are dead")));
}

TEST(Positions, ATableThatIsNotAsDocumentedIsRefused) {
  const std::pair<const char*, const char*> table[] = {
      {"x_mm,y_mm,foo\n1,2,3\n", ":1: column 'foo' must be one of x_mm, y_mm, z_mm, nx, ny, nz, channel, alive, dead;"},
      {"x_mm;y_mm\n1,5;2\n",
       ":1: column 'x_mm;y_mm' must be one of x_mm, y_mm, z_mm, nx, ny, nz, channel, alive, "
       "dead; the first line names the columns, with commas between them, and numbers have a decimal point"},
      {"# a note\n1 2 3\n", ":2: column '1' must be one of x_mm"},  // no header: whatever its unit may be
      {"x_mm,id\n1,2\n", ":1: the header must name y_mm"},
      {"x_mm,y_mm,x_m\n1,2,3\n", ":1: column x_mm is there twice"},
      {"x_mm,y_mm\n1,5,2,5\n", ":2: 4 values, must be 2 as in the header"},
      {"x_mm\ty_mm\n1,5\t2,5\n", ":2: x_mm = 1,5 must be a number, such as -1.5"},
      {"x_mm,y_mm\n1,1e10\n", ":2: y_mm = 1e10 must be at most 1000000000 in magnitude"},
      {"x_mm,y_mm\n", ": no positions in it, must hold at least one"},
      {"x_mm,y_mm,nx,ny\n1,2,0,1\n", ": the header must name nx, ny and nz, or none of them"},
      {"x_mm,y_mm,nx,ny,nz\n1,2,0,0,1\n3,4,0,0,0\n", ":3: the axis must not be zero"},
      {"x_mm,y_mm,alive\n0,0,0.5\n", ":2: alive = 0.5 must be 0 or 1"},
      {"x_mm,y_mm,alive,dead\n0,0,1,0\n", ": the header must name alive or dead, one of them"},
      {"channel,x_mm,y_mm\n1,0,0\n0,10,0\n", ":3: channel = 0 must be 2, one above the row before it"},
      {"x_mm,y_mm\n\xFF,2\n", ":2:1: byte 0xff is not UTF-8 text"},
  };
  for (const auto& [text, phrase] : table) {
    EXPECT_THAT(message_of<InputError>([&] { positions_of(text); }), HasSubstr("array.csv" + std::string(phrase)))
        << text;
  }
}

}  // namespace
}  // namespace touchfield
