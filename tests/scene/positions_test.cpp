#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/scene/measured_points.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::problems_of;
using testing::TempFolder;

const std::string kSceneOfFile =
    "name: files\n"
    "array: {positions: {file: array.csv}}\n"
    "body: {sphere: {radius_mm: 8}, edge_mm: 2}\n"
    "solve: {methods: [{fixed: {phases_rad: 0}}]}\n";

ArraySpec array_of_file(const std::string& table) {
  const TempFolder folder;
  folder.write("array.csv", table);
  return read_scene(folder.write("scene.yaml", kSceneOfFile), {}).array;
}

PositionsArray positions_of(const std::string& table) { return std::get<PositionsArray>(array_of_file(table).layout); }

/// The problems of a positions file, each without the folder.
std::vector<std::string> faults_of_positions(const std::string& table, const std::string& scene = kSceneOfFile) {
  const TempFolder folder;
  folder.write("array.csv", table);
  std::vector<std::string> faults = problems_of(folder.write("scene.yaml", scene));
  for (std::string& fault : faults) {
    const std::string path = folder.path().string() + "/";
    if (const auto at = fault.find(path); at != std::string::npos) {
      fault.erase(at, path.size());
    }
  }
  return faults;
}

/// Transducers at (1, 2, 3) and (-4, 5, 6) mm.
Points two_points() {
  Points points(3, 2);
  points << 1e-3, -4e-3, 2e-3, 5e-3, 3e-3, 6e-3;
  return points;
}

TEST(Positions, OneArrayInEveryHeaderIsTheSame) {
  for (const char* table : {
           "1,2,3\n-4,5,6\n",
           "x_mm,y_mm,z_mm\n1,2,3\n-4,5,6\n",
           "x_m,y_m,z_m\n0.001,0.002,0.003\n-0.004,0.005,0.006\n",
           "x_mm,y_m,z_cm\n1,0.002,0.3\n-4,0.005,0.6\n",
           "X_UM,y_um,z_um\n1000,2000,3000\n-4000,5000,6000\n",
           "x,y,z\n1,2,3\n-4,5,6\n",
           "z,y,x\n3,2,1\n6,5,-4\n",
           "X (mm), Y (mm), Z (mm)\n1, 2, 3\n-4, 5, 6\n",
           "x [m]; y [m]; z [m]\n1e-3; 2e-3; 3e-3\n-4e-3; 5e-3; 6e-3\n",
           "x/mm\ty/mm\tz/mm\n1\t2\t3\n-4\t5\t6\n",
           "\"x_mm\",\"y_mm\",\"z_mm\"\n\"1\",\"2\",\"3\"\n-4,5,6\n",
           "# x_m y_m z_m\n# from the workshop\n.001,.002,.003\n-.004,.005,.006\n",
           "x_mm y_mm z_mm\n1  2 3\n-4 5   6\n",
           "\xEF\xBB\xBFx_mm,y_mm,z_mm\r\n1,2,3\r\n-4,5,6\r\n",
           "id,x_mm,y_mm,z_mm\nT7,1,2,3\nT3,-4,5,6\n",
           ",x_mm,y_mm,z_mm\n0,1,2,3\n1,-4,5,6\n",
           "channel,z_mm,name,y_mm,x_mm\n0,3,a,2,1\n1,6,b,5,-4\n",
       }) {
    const PositionsArray array = positions_of(table);
    EXPECT_EQ(array.points, two_points()) << table;
    EXPECT_EQ(array.axes, Vector3::UnitZ().replicate(1, 2)) << table;
  }
}

TEST(Positions, WithoutZTheArrayIsFlat) {
  Points flat = two_points();
  flat.row(2).setZero();
  EXPECT_EQ(positions_of("id,x_mm,y_mm\n0,1,2\n1,-4,5\n").points, flat);
}

TEST(Positions, AxesByAnyOfTheirNames) {
  Points axes(3, 2);
  axes << 0, 1, 0, 0, -1, 0;
  for (const char* header :
       {"x_mm,y_mm,z_mm,nx,ny,nz", "x,y,z,ax,ay,az", "x_mm,y_mm,z_mm,Normal_X,normal_y,normal z"}) {
    EXPECT_EQ(positions_of(std::string(header) + "\n1,2,3,0,0,-2\n-4,5,6,5,0,0\n").axes, axes) << header;
  }
  EXPECT_EQ(positions_of("nz,ny,nx,x_mm,y_mm\n-2,0,0,1,2\n0,0,5,-4,5\n").axes, axes);
  EXPECT_THAT(faults_of_positions("x_mm,y_mm,nx,ny\n1,2,0,1\n"),
              ElementsAre("array.csv: the header must name nx, ny and nz, or none of them"));
  EXPECT_THAT(faults_of_positions("x_mm,y_mm,nx,ny,nz\n1,2,0,0,1\n3,4,0,0,0\n"),
              ElementsAre("array.csv:3: the axis must not be zero"));
}

TEST(Positions, DeadTransducersAreACalibration) {
  for (const char* table : {"x_mm,y_mm,alive\n0,0,1\n10,0,0\n20,0,1\n", "x_mm,y_mm,dead\n0,0,0\n10,0,1\n20,0,0\n"}) {
    const ArraySpec array = array_of_file(table);
    ASSERT_TRUE(array.calibration) << table;
    EXPECT_THAT(array.calibration->gain, ElementsAre(1, 0, 1));
    EXPECT_THAT(array.calibration->phase, ElementsAre(0, 0, 0));
    EXPECT_EQ(array.calibration->in, ResponseOf::kBoth);
  }
  EXPECT_FALSE(array_of_file("x_mm,y_mm,alive\n0,0,1\n10,0,1\n").calibration);
  EXPECT_THAT(faults_of_positions("x_mm,y_mm,alive\n0,0,0.5\n"),
              ElementsAre("array.csv:2: alive = 0.5 must be 0 or 1"));
  std::string both = kSceneOfFile;
  both.replace(both.find("array.csv}"), 10, "array.csv}, calibration: {gain: [1], phase_rad: [0]}");
  EXPECT_THAT(faults_of_positions("x_mm,y_mm,alive\n0,0,0\n", both),
              ElementsAre(HasSubstr("array.positions.file says which transducers are dead")));
}

TEST(Positions, WhatAHeaderSaysWrongIsNamed) {
  const auto fault = [](const std::string& header) {
    const std::vector<std::string> faults = faults_of_positions(header + "\n1,2,3\n");
    return faults.empty() ? std::string() : faults.front();
  };
  EXPECT_THAT(fault("x_mm,y_mm,foo"), HasSubstr("array.csv:1: column foo must be one of x_mm, y_mm, z_mm, nx"));
  EXPECT_THAT(fault("x_in,y_in,z_in"), HasSubstr("column x_in must be one of"));
  EXPECT_THAT(fault("x_mm,z_mm,id"), HasSubstr("array.csv:1: a header with the column y_mm must come first"));
  EXPECT_THAT(fault("x_mm,y_mm,x_m"), HasSubstr("array.csv:1: column x_mm is there twice"));
  EXPECT_THAT(fault("nx,ax,y_mm"), HasSubstr("column nx is there twice"));
  EXPECT_THAT(fault("x_m,y,z"), HasSubstr("column z has no unit and x_m has one"));
  EXPECT_THAT(fault("x_mm,y_mm,"), HasSubstr("column without a name must be one of"));
  for (const char* column : {"phase", "phase_rad", "Phase (deg)", "amplitude", "gain"}) {
    EXPECT_THAT(fault(std::string("x_mm,y_mm,") + column), HasSubstr("phases_file"));
    EXPECT_THAT(fault(std::string("x_mm,y_mm,") + column), HasSubstr(std::string("column ") + column));
  }
  EXPECT_THAT(faults_of_positions("channel,x_mm,y_mm\n1,0,0\n0,10,0\n"),
              ElementsAre("array.csv:3: channel = 0 must be 2, one above the row before it: rows are channels in their "
                          "order, and alive = 0 marks one that is missing"));
  EXPECT_THAT(faults_of_positions("channel,x_mm,y_mm\n0,0,0\n2,10,0\n"), ElementsAre(HasSubstr("must be 1")));
  EXPECT_THAT(faults_of_positions("1,2,3,4\n"),
              ElementsAre(HasSubstr("array.csv:1: 4 values, must be 3 or 6, or a header must name the columns")));
  EXPECT_THAT(faults_of_positions("x_mm;y_mm\n1,5;2\n"),
              ElementsAre("array.csv:2: x_mm = 1,5 must be a number with a point, not a comma"));
  EXPECT_THAT(faults_of_positions("x_mm,y_mm\n"), ElementsAre("array.csv: no positions in it, must hold at least one"));
}

TEST(Positions, MeasuredPointsMayBeInMetres) {
  const TempFolder folder;
  const MeasuredPoints points =
      read_measured_points(folder.write("p.csv", "X [m];Y [m];Z [m];P [Pa]\n.001;.002;.003;9\n"));
  EXPECT_EQ(points.points.col(0), two_points().col(0));
  EXPECT_EQ(points.pressure(0), Complex(9));
  EXPECT_THAT(support::message_of<InputError>(
                  [&] { read_measured_points(folder.write("q.csv", "x,y_mm,z_mm,p_pa\n1,2,3,9\n")); }),
              HasSubstr("column x must be one of x_mm"));
}

}  // namespace
}  // namespace touchfield
