#include <algorithm>
#include <random>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/scene/number_files.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

using support::message_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::problems_of;
using testing::TempFolder;

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
      {"1,2,3\n", ":1: column '1' must be one of x_mm"},  // no header: whatever its unit may be
      {"# a note\n1 2 3\n", ":2: column '1' must be one of x_mm"},
      {"x,y,z\n1,2,3\n", ":1: column 'x' must be one of"},
      {"x_in,y_in\n1,2\n", ":1: column 'x_in' must be one of"},
      {"X_mm,y_mm\n1,2\n", ":1: column 'X_mm' must be one of"},
      {"x_mm,y_mm,phase_rad\n1,2,3\n", ":1: column 'phase_rad' must be one of"},
      {"x_mm,y_mm,\n1,2,3\n", ":1: column '' must be one of"},
      {"x_mm,id\n1,2\n", ":1: the header must name y_mm"},
      {"x_mm,y_mm,x_m\n1,2,3\n", ":1: column x_mm is there twice"},
      {"x_mm,y_mm\n1,5,2,5\n", ":2: 4 values, must be 2 as in the header"},
      {"x_mm\ty_mm\n1,5\t2,5\n", ":2: x_mm = 1,5 must be a number, such as -1.5"},
      {"x_mm,y_mm\n1,\n", ":2: y_mm = no value must be a number"},
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

TEST(Positions, ColumnsOfARandomOrderAndUnitsAreNeverExchanged) {
  std::mt19937 random(5);
  const std::pair<const char*, double> units[] = {{"um", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}};
  for (int round = 0; round < 200; ++round) {
    std::vector<int> order{0, 1, 2};
    std::ranges::shuffle(order, random);
    std::string header;
    std::string row;
    Vector3 expected;
    for (const int axis : order) {
      const auto& [unit, metres] = units[random() % 4];
      const int value = static_cast<int>(random() % 2000) - 1000;
      header += fmt::format("{}{}_{}", header.empty() ? "" : ",", "xyz"[axis], unit);
      row += fmt::format("{}{}", row.empty() ? "" : ",", value);
      expected(axis) = value * metres;
    }
    EXPECT_TRUE(positions_of(header + "\n" + row + "\n").points.isApprox(expected, 1e-14)) << header << "\n" << row;
  }
}

TEST(MeasuredPoints, MayBeInMetres) {
  const TempFolder folder;
  const MeasuredPoints points = read_measured_points(folder.write("p.csv", "x_m,y_m,z_m,p_pa\n.001,.002,.003,9\n"));
  EXPECT_EQ(points.points.col(0), two_points().col(0));
  EXPECT_EQ(points.pressure(0), Complex(9));
}

}  // namespace
}  // namespace touchfield
