#include "sim/hand/hand_skeleton.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "sim/core/units.h"

namespace touchfield {

namespace {

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
