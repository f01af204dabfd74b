#include <fstream>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/cameras/hand_tables.h"
#include "sim/core/units.h"
#include "tests/support/joint_table_support.h"
#include "tests/support/scene_support.h"
#include "tests/support/testing.h"

namespace touchfield::joint_table_test {

bool is_palm(const std::string& joint) { return joint == "palm" || joint.ends_with("_metacarpal"); }

/// A header of all joints, or of those that are used, whose names end so.
std::string header(const std::string& unit, bool all = true) {
  std::string line = "time_s";
  for (const std::string joint : kOpenXrJoints) {
    for (const char axis : {'x', 'y', 'z'}) {
      line += all || !is_palm(joint) ? fmt::format(",{}_{}{}", joint, axis, unit) : "";
    }
  }
  return line + "\n";
}

/// Joint j at (j, 0.1, 0.2) times scale, counted among those that are written.
std::string row(double seconds, double scale, std::size_t count = kOpenXrJoints.size()) {
  std::string line = fmt::format("{}", seconds);
  for (std::size_t j = 0; j < count; ++j) {
    line += fmt::format(",{},{},{}", scale * static_cast<double>(j), 0.1 * scale, 0.2 * scale);
  }
  return line + "\n";
}

class JointTable : public ::testing::Test {
 protected:
  JointRecording read(const std::string& text, const RigidMotion& pose = {}) {
    std::ofstream(folder_.path() / "hand.csv") << text;
    return read_joints(folder_.file("hand.csv"), pose);
  }
  std::string fault(const std::string& text) {
    return message_of<InputError>([&] { read(text); });
  }

 private:
  TemporaryDirectory folder_;
};

// The wrist is OpenXR's joint 1, the thumb's proximal 3, the index finger's proximal 7, the last 25.
TEST_F(JointTable, TakesTheJointsThatASkeletonHasInEachUnit) {
  const JointRecording metres = read(header("") + row(5, 1) + row(5.5, 2));
  EXPECT_THAT(metres.seconds, ElementsAre(5, 5.5));
  const JointPoints& joints = *metres.joints[1];
  EXPECT_EQ(Vector3(joints.col(0)), Vector3(2, 0.2, 0.4));
  EXPECT_EQ(joints(0, 1), 6);
  EXPECT_EQ(joints(0, 4), 14);
  EXPECT_EQ(joints(0, kTrackedJoints - 1), 50);
  EXPECT_EQ(*read(header("_m") + row(5, 1)).joints[0], *metres.joints[0]);
  EXPECT_TRUE(read(header("_mm") + row(5, 1000)).joints[0]->isApprox(*metres.joints[0], 1e-15));
  EXPECT_EQ((*read(header("", false) + row(5, 1, 20)).joints[0])(0, kTrackedJoints - 1), 19);
}

TEST_F(JointTable, ReadsPastRadiiAndPlacesTheTracker) {
  RigidMotion pose;
  pose.rotation = Eigen::AngleAxisd(90 * kDegree, Vector3::UnitZ()).toRotationMatrix();
  pose.shift = {0, 0, 1};
  std::string names = header("");
  names.insert(names.size() - 1, ",index_tip_radius");
  std::string values = row(1, 1);
  values.insert(values.size() - 1, ",0.008");
  const JointRecording placed = read(names + values, pose);
  EXPECT_TRUE(placed.joints[0]->col(0).isApprox(Vector3(-0.1, 1, 1.2), 1e-12));
}

TEST_F(JointTable, RowsWithoutAHandAreLost) {
  std::string empty = row(1, 1);
  empty.replace(empty.find(",1,"), 3, ",,");  // the wrist's x
  std::string nan = row(2, 1);
  nan.replace(nan.find(",1,"), 3, ",NaN,");
  std::string palm = row(3, 1);
  palm.replace(palm.find(",0,"), 3, ",,");  // of a joint that is not used
  const JointRecording read_rows = read(header("") + row(0, 1) + empty + nan + palm + row(4, 0));
  EXPECT_TRUE(read_rows.joints[0].has_value());
  EXPECT_FALSE(read_rows.joints[1].has_value());
  EXPECT_FALSE(read_rows.joints[2].has_value());
  EXPECT_TRUE(read_rows.joints[3].has_value());
  EXPECT_FALSE(read_rows.joints[4].has_value());  // all at the origin
}

TEST_F(JointTable, NamesWhatIsWrong) {
  const auto changed = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string names = header("");
  EXPECT_THAT(fault(changed(names, "index_tip_x", "index_tipp_x") + row(0, 1)),
              HasSubstr("hand.csv:1: column 'index_tipp_x' must be one of time_s, or x, y and z of a joint as OpenXR"));
  EXPECT_THAT(fault(changed(names, ",little_tip_z", "") + row(0, 1)),
              HasSubstr(":1: the header must name little_tip_z"));
  EXPECT_THAT(fault(changed(names, "index_tip_x", "index_tip_x_mm") + row(0, 1)),
              HasSubstr("without a unit and index_tip_x with one: name that of both"));
  EXPECT_THAT(fault(names + row(1, 1) + row(1, 1)), HasSubstr("hand.csv:3: time_s = 1 must be after 1"));
  EXPECT_THAT(fault(names + "0,1,2\n"), HasSubstr("hand.csv:2: 3 values, must be 79 as in the header"));
  EXPECT_THAT(fault(names + changed(row(0, 1), ",1,", ",here,")),
              HasSubstr("hand.csv:2: wrist_x = here must be a number"));
  EXPECT_THAT(fault(names), HasSubstr("no frames in it, must hold at least one"));
}

TEST(JointRow, IsThatOfATableWithoutHeader) {
  const JointPoints joints = JointPoints::Random();
  const auto read = joints_of_row(joint_row_text(joints) + "\r\n");
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->isApprox(joints, 1e-8));
  RigidMotion pose;
  pose.shift = Vector3(1, 2, 3);
  EXPECT_TRUE(joints_of_row(joint_row_text(joints), pose)->isApprox(joints.colwise() + pose.shift, 1e-8));
  EXPECT_FALSE(joints_of_row(joint_row_text(JointPoints::Zero())));
  EXPECT_FALSE(joints_of_row("7" + std::string(78, ',')));
}

}  // namespace touchfield::joint_table_test
