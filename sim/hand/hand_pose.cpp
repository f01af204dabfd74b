#include "sim/hand/hand_pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr std::array<NamedJoint, 21> kJoints{{{"thumb", "cmc_flexion", -25, 35},
                                              {"thumb", "cmc_abduction", -30, 60},
                                              {"thumb", "cmc_rotation", -60, 80},
                                              {"thumb", "mcp", -10, 80},
                                              {"thumb", "ip", -15, 80},
                                              {"index", "abduction", -15, 42},
                                              {"index", "mcp", 0, 90},
                                              {"index", "pip", 0, 100},
                                              {"index", "dip", -10, 90},
                                              {"middle", "abduction", -20, 20},
                                              {"middle", "mcp", 0, 90},
                                              {"middle", "pip", 0, 100},
                                              {"middle", "dip", -10, 90},
                                              {"ring", "abduction", -15, 25},
                                              {"ring", "mcp", 0, 90},
                                              {"ring", "pip", 0, 100},
                                              {"ring", "dip", -10, 90},
                                              {"little", "abduction", -15, 45},
                                              {"little", "mcp", 0, 90},
                                              {"little", "pip", 0, 100},
                                              {"little", "dip", -10, 90}}};

FingerAngles finger(double abduction, double mcp, double pip, double dip) {
  return {abduction * kDegree, mcp * kDegree, pip * kDegree, dip * kDegree};
}

ThumbAngles thumb(double flexion, double abduction, double rotation, double mcp, double ip) {
  return {flexion * kDegree, abduction * kDegree, rotation * kDegree, mcp * kDegree, ip * kDegree};
}

/// Where the angles of a thumb and of four fingers are, in their row.
template <class Thumb, class... Fingers>
auto row_of(Thumb& thumb, Fingers&... fingers) {
  std::array<decltype(&thumb.mcp), 21> row{&thumb.cmc_flexion, &thumb.cmc_abduction, &thumb.cmc_rotation, &thumb.mcp,
                                           &thumb.ip};
  auto next = row.begin() + joint_count(0);
  ((next = std::ranges::copy(std::array{&fingers.abduction, &fingers.mcp, &fingers.pip, &fingers.dip}, next).out), ...);
  return row;
}
template <class Pose>
auto pose_row(Pose& pose) {
  return row_of(pose.thumb, pose.fingers[0], pose.fingers[1], pose.fingers[2], pose.fingers[3]);
}
template <class Joints>
auto joints_row(Joints& joints) {
  return row_of(joints.thumb, joints.index, joints.middle, joints.ring, joints.little);
}

/// Lengths of bones [mm]; the tip's tissue is added to the last.
struct FingerBones {
  double proximal;
  double middle;
  double distal;
  double tip;
  double head_y;                    // of the metacarpal from the wrist joint, share of the hand's length
  double head_x;                    // share of the hand's breadth
  double head_z;                    // share of the breadth: the arch of the palm
  double abducts;                   // 1: towards the thumb, -1: away from it
  double lean;                      // of the fully flexed finger towards the thumb's side [degrees]
  std::array<double, 3> thickness;  // of the segments, share of the breadth
};

constexpr std::array<FingerBones, 4> kFingers = {{
    {39.78, 22.38, 15.82, 3.84, 0.374, 0.252, -0.010, 1.0, -3.0, {0.229, 0.198, 0.176}},
    {44.63, 26.33, 17.40, 3.95, 0.373, 0.000, 0.000, 1.0, 2.0, {0.216, 0.197, 0.180}},
    {41.37, 25.65, 17.30, 3.95, 0.336, -0.258, -0.012, -1.0, 7.0, {0.203, 0.182, 0.168}},
    {32.74, 18.11, 15.96, 3.73, 0.295, -0.446, -0.045, -1.0, 13.0, {0.183, 0.165, 0.149}},
}};

constexpr double kThumbMetacarpal = 46.22;
constexpr double kThumbProximal = 31.57;
constexpr double kThumbDistal = 21.67 + 5.67;
constexpr double kThumbAtRest = 20 * kDegree;  // of its metacarpal from y, away from the index finger, unflexed
constexpr std::array<double, 2> kThumbThickness = {0.229, 0.212};

// The hand's length counts from the crease of the wrist, which lies this share of it behind the joint.
constexpr double kCreaseBehindJoint = 0.073;
// From the wrist joint to the middle fingertip: the metacarpal's head and the finger of the table.
constexpr double kMiddleFinger = 44.63 + 26.33 + 17.40 + 3.95;
constexpr double kTipRoundness = 0.95;  // radius of the ball at the tip over half the thickness of the segment

Eigen::Matrix3d turn(double angle, const Vector3& axis) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

/// Follows the bones of a chain: the frame's y runs along the bone, flexion turns about its x and moves y towards -z.
void follow(BoneChain& chain, Eigen::Matrix3d frame, const std::array<double, 3>& flexions,
            const std::array<double, 3>& lengths) {
  for (std::size_t i = 0; i < 3; ++i) {
    frame = frame * turn(-flexions[i], Vector3::UnitX());
    chain.joints[i + 1] = chain.joints[i] + lengths[i] * frame.col(1);
    chain.palmar[i] = -frame.col(2);
  }
}

BoneChain posed_finger(const FingerBones& bones, const FingerAngles& angles, double length, double breadth,
                       double bone_scale) {
  BoneChain chain;
  chain.joints[0] = {bones.head_x * breadth, bones.head_y * length, bones.head_z * breadth};
  // Fingers that flex converge on the base of the thumb: they lean to +x. Clockwise seen from the back of the hand,
  // abduction turns to the thumb.
  const double lean = bones.lean * kDegree * std::sin(angles.mcp);
  const Eigen::Matrix3d base =
      turn(-lean, Vector3::UnitY()) * turn(-bones.abducts * angles.abduction, Vector3::UnitZ());
  follow(chain, base, {angles.mcp, angles.pip, angles.dip},
         {bones.proximal * bone_scale, bones.middle * bone_scale, (bones.distal + bones.tip) * bone_scale});
  // Each segment has its thickness in the middle, each joint the mean of its neighbours.
  const auto& share = bones.thickness;
  const double pip = 0.25 * (share[0] + share[1]);
  const double dip = 0.25 * (share[1] + share[2]);
  chain.radii = {(share[0] - pip) * breadth, pip * breadth, dip * breadth, 0.5 * kTipRoundness * share[2] * breadth};
  return chain;
}

BoneChain posed_thumb(const ThumbAngles& angles, double length, double breadth, double bone_scale) {
  BoneChain chain;
  chain.joints[0] = {0.225 * breadth, 0.07 * length, -0.12 * breadth};
  const Eigen::Matrix3d metacarpal =
      turn(angles.cmc_flexion - kThumbAtRest, Vector3::UnitZ()) * turn(-angles.cmc_abduction, Vector3::UnitX());
  // The palm side faces the little finger when the rotation is 0.
  const Eigen::Matrix3d base = metacarpal * turn(0.5 * std::numbers::pi + angles.cmc_rotation, Vector3::UnitY());
  follow(chain, base, {0.0, angles.mcp, angles.ip},
         {kThumbMetacarpal * bone_scale, kThumbProximal * bone_scale, kThumbDistal * bone_scale});
  const double ip = 0.25 * (kThumbThickness[0] + kThumbThickness[1]);
  chain.radii = {0.165 * breadth, (kThumbThickness[0] - ip) * breadth, ip * breadth,
                 0.5 * kTipRoundness * kThumbThickness[1] * breadth};
  return chain;
}

}  // namespace

const std::array<NamedJoint, 21>& hand_joints() { return kJoints; }

const std::optional<double>& joint_in(const HandJoints& joints, Eigen::Index place) {
  return *joints_row(joints)[static_cast<std::size_t>(place)];
}
std::optional<double>& joint_in(HandJoints& joints, Eigen::Index place) {
  return *joints_row(joints)[static_cast<std::size_t>(place)];
}

JointAngles joint_angles(const HandPose& pose) {
  JointAngles angles;
  std::ranges::transform(pose_row(pose), angles.begin(), [](const double* angle) { return *angle; });
  return angles;
}

HandPose with_angles(HandPose pose, const JointAngles& angles) {
  const auto row = pose_row(pose);
  for (std::size_t i = 0; i < row.size(); ++i) {
    *row[i] = angles(static_cast<Eigen::Index>(i));
  }
  return pose;
}

JointRanges joint_ranges() {
  JointRanges ranges;
  std::ranges::transform(kJoints, ranges.least.begin(), [](const NamedJoint& joint) { return joint.least * kDegree; });
  std::ranges::transform(kJoints, ranges.most.begin(), [](const NamedJoint& joint) { return joint.most * kDegree; });
  return ranges;
}

const std::vector<HandPose>& hand_pose_table() {
  static const std::vector<HandPose> kPoses = {
      {"flat",
       thumb(-22, 15, -35, 8, 8),
       {finger(7, 3, 4, 3), finger(0, 3, 5, 3), finger(7, 3, 5, 3), finger(15, 4, 5, 3)}},
      {"index_up",
       thumb(-2, 49.5, -12.5, 59, 58),
       {finger(0, 0, 0, 0), finger(0, 80, 95, 50), finger(0, 80, 95, 50), finger(0, 80, 95, 50)}},
      {"grasp",
       thumb(16, 60, 75, 7, -8.5),
       {finger(-4, 36, 17, 10), finger(-7, 41.5, 15.5, 7.5), finger(7.5, 38.5, 16.5, 8.5), finger(12, 28.5, 19, 12)}},
      {"point_down",
       thumb(-2, 49.5, -12.5, 59, 58),
       {finger(0, 8, 10, 6), finger(0, 80, 95, 50), finger(0, 80, 95, 50), finger(0, 80, 95, 50)}},
      {"fist",
       thumb(-15, 58, -15.5, 78, 33),
       {finger(0, 85, 100, 60), finger(0, 85, 100, 60), finger(0, 85, 100, 60), finger(0, 85, 100, 60)}},
  };
  return kPoses;
}

HandPose hand_pose(const std::string& name, const HandJoints& joints) {
  const std::vector<HandPose>& poses = hand_pose_table();
  const auto found = std::find_if(poses.begin(), poses.end(), [&](const HandPose& pose) { return pose.name == name; });
  if (found == poses.end()) {
    std::string known;
    for (const HandPose& pose : poses) {
      known += (known.empty() ? "" : ", ") + pose.name;
    }
    throw InputError(fmt::format("hand.pose = '{}' must be one of {}", name, known));
  }
  HandPose pose = *found;
  const auto angles = pose_row(pose);
  const auto wanted = joints_row(joints);
  for (std::size_t i = 0; i < kJoints.size(); ++i) {
    if (!*wanted[i]) {
      continue;
    }
    constexpr double kRounding = 1e-9;  // of degrees turned into radians and back
    const auto& [digit, name, least, most] = kJoints[i];
    const double degrees = **wanted[i] / kDegree;
    require(degrees >= least - kRounding && degrees <= most + kRounding,
            "hand.joints.{}.{} = {:.6g} degrees must be {} to {} degrees", digit, name, degrees, least, most);
    *angles[i] = **wanted[i];
  }
  return pose;
}

HandSkeleton posed_skeleton(const HandPose& pose, double length, double breadth) {
  const double bone_scale = (1.0 - kCreaseBehindJoint - kFingers[1].head_y) * length / kMiddleFinger;
  HandSkeleton skeleton;
  skeleton.length = length;
  skeleton.breadth = breadth;
  skeleton.thumb = posed_thumb(pose.thumb, length, breadth, bone_scale);
  for (std::size_t i = 0; i < 4; ++i) {
    skeleton.fingers[i] = posed_finger(kFingers[i], pose.fingers[i], length, breadth, bone_scale);
  }
  return skeleton;
}

}  // namespace touchfield
