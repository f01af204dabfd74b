#include "sim/hand/skinned_hand.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/require.h"
#include "sim/mesh/face_shape.h"

namespace touchfield {

namespace {

/// How a digit holds the skin about it. Measured: with narrower webs skin folds between fingers that are bent
/// differently, with wider ones their knuckles drag each other along.
struct Hold {
  double base_reach;  // of the joint at its base [radii there]
  double web;         // width of its hold at the web [radii of the base], and along the free digit
  double free;
  double web_end;  // up to where the web is that wide, and from where on the digit is free [bones from the base]
  double free_start;
};
constexpr Hold kThumbHold{1.5, 3.0, 0.5, 1.0, 1.9};
constexpr Hold kFingerHold{2.0, 5.0, 0.35, 0.4, 1.0};
constexpr double kJointReach = 1.8;  // of the other joints [radii there]
// Over the thumb's metacarpal its turn about itself grows, about this place and as far to either side [bones].
constexpr double kTwistMiddle = 0.6;
constexpr double kTwistReach = 0.5;
// Faces that show less of their template's area than this to the side that their bones turned them to are mended.
// Measured: with more, skin that is pressed together is moved until it cuts itself.
constexpr double kLeastFacing = 0.02;
constexpr int kMostRounds = 100;  // 18 are the most that free poses took

/// From 0 at -1 to 1 at 1: a constant slope over the middle half, falling linearly to 0 outside it.
double ramp(double u) {
  constexpr double kMiddle = 0.5;
  constexpr double kSlope = 1.0 / (1.0 + kMiddle);
  const double size = std::abs(u);
  const double left = std::max(1.0 - size, 0.0);
  const double below = size <= kMiddle ? 0.5 - kSlope * size : 0.5 * kSlope * left * left / (1.0 - kMiddle);
  return u < 0 ? below : 1.0 - below;
}

/// The ramp from one place to another.
double ramp(double x, double from, double to) { return ramp((2.0 * x - from - to) / (to - from)); }

/// A digit, with its ray in the palm, as a point is held by it.
struct Grip {
  double gap;                     // from its flesh [m]
  double width;                   // over which its hold fades [m]
  std::array<double, 5> weights;  // palm, swing of the thumb's metacarpal, the three bones
};

/// start   of the ray in the palm
Grip grip_of(const BoneChain& chain, const Vector3& start, double start_radius, const Hold& hold, bool thumb,
             const Vector3& x) {
  const std::array<Vector3, 5> ends = {start, chain.joints[0], chain.joints[1], chain.joints[2], chain.joints[3]};
  const std::array<double, 5> radii = {start_radius, chain.radii[0], chain.radii[1], chain.radii[2], chain.radii[3]};
  Grip grip{std::numeric_limits<double>::infinity(), 0.0, {}};
  std::size_t nearest = 0;
  double along = 0;  // in bones from the base
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3 axis = ends[i + 1] - ends[i];
    const double t = std::clamp((x - ends[i]).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    const double gap = (x - ends[i] - t * axis).norm() - radii[i] - t * (radii[i + 1] - radii[i]);
    if (gap < grip.gap) {
      grip.gap = gap;
      nearest = i;
      along = static_cast<double>(i) - 1.0 + t;
    }
  }
  std::array<double, 3> beyond{};  // the joints
  for (std::size_t j = 0; j < 3; ++j) {
    const Vector3 axis = (ends[j + 1] - ends[j]).normalized() + (ends[j + 2] - ends[j + 1]).normalized();
    const double reach = (j == 0 ? hold.base_reach : kJointReach) * radii[j + 1];
    // A curled digit comes back to joints that it has left behind.
    const bool within = nearest + 1 >= j && nearest <= j + 2;
    beyond[j] = within ? ramp((x - ends[j + 1]).dot(axis.normalized()) / reach) : nearest > j ? 1.0 : 0.0;
  }
  const Vector3 first = ends[2] - ends[1];
  const double on_first = (x - ends[1]).dot(first) / first.squaredNorm();
  const double turned =
      !thumb ? 1.0 : std::max(ramp((on_first - kTwistMiddle) / kTwistReach), nearest > 1 ? beyond[1] : 0.0);
  const double on_bone = beyond[0] * (1.0 - beyond[1]);
  grip.weights = {1.0 - beyond[0], on_bone * (1.0 - turned), on_bone * turned,
                  beyond[0] * beyond[1] * (1.0 - beyond[2]), beyond[0] * beyond[1] * beyond[2]};
  grip.width = radii[1] * (hold.web + (hold.free - hold.web) * ramp(along, hold.web_end, hold.free_start));
  return grip;
}

Eigen::Vector4d product(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  Eigen::Vector4d result;
  result(0) = a(0) * b(0) - a.tail<3>().dot(b.tail<3>());
  result.tail<3>() = a(0) * b.tail<3>() + b(0) * a.tail<3>() + a.tail<3>().cross(b.tail<3>());
  return result;
}

Vector3 rotated(const Eigen::Vector4d& quaternion, const Vector3& x) {
  const Vector3 axis = quaternion.tail<3>();
  const Vector3 twice = 2.0 * axis.cross(x);
  return x + quaternion(0) * twice + axis.cross(twice);
}

}  // namespace

Eigen::Matrix3d bone_frame(const BoneChain& chain, std::size_t bone) {
  Eigen::Matrix3d frame;
  frame.col(1) = chain.direction(static_cast<int>(bone));
  frame.col(2) = chain.palmar[bone];
  frame.col(0) = frame.col(1).cross(frame.col(2));
  return frame;
}

std::string bone_name(std::size_t digit, std::size_t bone) {
  constexpr std::array<const char*, HandSkeleton::kDigits> kNames = {"thumb", "index finger", "middle finger",
                                                                     "ring finger", "little finger"};
  constexpr std::array<const char*, 4> kBoneNames = {"metacarpal", "proximal phalanx", "middle phalanx",
                                                     "distal phalanx"};
  const std::size_t kind = digit > 0 || bone == 2 ? bone + 1 : bone;  // the thumb has no middle phalanx
  return fmt::format("{} of the {}", kBoneNames[kind], kNames[digit]);
}

SkinnedHand::SkinnedHand(const Points& vertices, const HandSkeleton& made_in, HandSide side)
    : made_in_(made_in), side_(mirror_sign(side)), template_(vertices) {
  require(vertices.cols() != 0 && vertices.allFinite(),
          "skinned hand: its {} vertices must be finite numbers, one at least", vertices.cols());
  template_.row(0) *= side_;
  starts_.push_back(0);
  for (Eigen::Index v = 0; v < template_.cols(); ++v) {
    add_influences(template_.col(v));
  }
}

void SkinnedHand::add_influences(const Vector3& x) {
  const double b = made_in_.breadth;
  const double l = made_in_.length;
  std::array<Grip, HandSkeleton::kDigits> grips;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < grips.size(); ++i) {
    const Vector3 base = made_in_.digit(i).joints[0];
    const Vector3 start =
        i == 0 ? Vector3(0.1 * b, -0.02 * l, -0.05 * b) : Vector3(0.6 * base.x(), 0.05 * l, 0.5 * base.z() - 0.03 * b);
    grips[i] = grip_of(made_in_.digit(i), start, 0.15 * b, i == 0 ? kThumbHold : kFingerHold, i == 0, x);
    nearest = grips[i].gap < grips[nearest].gap ? i : nearest;
  }
  std::array<double, kBones> weights{};
  double sum = 0;
  for (std::size_t i = 0; i < grips.size(); ++i) {
    const double width = std::sqrt(grips[i].width * grips[nearest].width);
    const double fade = std::max(1.0 - (grips[i].gap - grips[nearest].gap) / width, 0.0);
    const double share = fade * fade * fade;
    sum += share;
    weights[kPalm] += share * grips[i].weights[0];
    weights[kSwing] += share * grips[i].weights[1];
    for (std::size_t k = 0; k < 3; ++k) {
      weights[bone_number(i, k)] += share * grips[i].weights[k + 2];
    }
  }
  const auto first = static_cast<std::ptrdiff_t>(influences_.size());
  for (std::size_t bone = 0; bone < kBones; ++bone) {
    if (weights[bone] > 0) {
      influences_.push_back({bone, weights[bone] / sum});
    }
  }
  std::sort(influences_.begin() + first, influences_.end(),
            [](const Influence& one, const Influence& other) { return one.weight > other.weight; });
  starts_.push_back(influences_.size());
}

void SkinnedHand::DualQuaternion::add(const DualQuaternion& other, double weight) {
  real += weight * other.real;
  dual += weight * other.dual;
}

void SkinnedHand::DualQuaternion::normalize() {
  const double scale = 1.0 / real.norm();
  real *= scale;
  dual *= scale;
}

SkinnedHand::Motions SkinnedHand::dual_quaternions(const std::array<RigidMotion, kBones>& motions) {
  Motions result;
  for (std::size_t b = 0; b < kBones; ++b) {
    const Eigen::Quaterniond turn(motions[b].rotation);
    const Vector3 half = 0.5 * motions[b].shift;
    result[b].real << turn.w(), turn.vec();
    result[b].dual = product({0.0, half.x(), half.y(), half.z()}, result[b].real);
  }
  return result;
}

std::array<RigidMotion, SkinnedHand::kBones> SkinnedHand::bone_motions(const HandSkeleton& from,
                                                                       const HandSkeleton& to) {
  const auto motion = [](const Eigen::Matrix3d& rotation, const Vector3& start, const Vector3& end) {
    return RigidMotion{rotation, end - rotation * start};
  };
  std::array<RigidMotion, kBones> motions;
  for (std::size_t i = 0; i < HandSkeleton::kDigits; ++i) {
    const BoneChain& one = from.digit(i);
    const BoneChain& other = to.digit(i);
    for (std::size_t bone = 0; bone < 3; ++bone) {
      motions[bone_number(i, bone)] =
          motion(bone_frame(other, bone) * bone_frame(one, bone).transpose(), one.joints[bone], other.joints[bone]);
    }
  }
  const auto swing = Eigen::Quaterniond::FromTwoVectors(from.thumb.direction(0), to.thumb.direction(0));
  motions[kSwing] = motion(swing.toRotationMatrix(), from.thumb.joints[0], to.thumb.joints[0]);
  return motions;
}

SkinnedHand::Motions SkinnedHand::motions_to(const HandSkeleton& posed) const {
  require(posed.length == made_in_.length && posed.breadth == made_in_.breadth,
          "skinned hand: the pose is of a hand {} m long and {} m broad, this hand is {} m long and {} m broad",
          posed.length, posed.breadth, made_in_.length, made_in_.breadth);
  return dual_quaternions(bone_motions(made_in_, posed));
}

std::vector<SkinnedHand::DualQuaternion> SkinnedHand::blended(const Motions& motions) const {
  std::vector<DualQuaternion> moves;
  moves.reserve(static_cast<std::size_t>(template_.cols()));
  for (Eigen::Index v = 0; v < template_.cols(); ++v) {
    moves.push_back(blended(motions, v));
  }
  return moves;
}

SkinnedHand::DualQuaternion SkinnedHand::blended(const Motions& motions, Eigen::Index vertex) const {
  const auto v = static_cast<std::size_t>(vertex);
  const Eigen::Vector4d& heaviest = motions[influences_[starts_[v]].bone].real;
  DualQuaternion sum;
  for (std::size_t k = starts_[v]; k < starts_[v + 1]; ++k) {
    const DualQuaternion& one = motions[influences_[k].bone];
    sum.add(one, one.real.dot(heaviest) < 0 ? -influences_[k].weight : influences_[k].weight);
  }
  sum.normalize();
  return sum;
}

void SkinnedHand::pose(const HandSkeleton& posed, Points& vertices) const {
  move(motions_to(posed), template_, 1.0, vertices);
}

void SkinnedHand::pose(const Points& rest, const HandSkeleton& from, const HandSkeleton& posed,
                       Points& vertices) const {
  move(dual_quaternions(bone_motions(from, posed)), rest, side_, vertices);
}

Vector3 SkinnedHand::placed(const DualQuaternion& q, const Vector3& x) {
  const Eigen::Vector4d inverse(q.real(0), -q.real(1), -q.real(2), -q.real(3));
  return rotated(q.real, x) + 2.0 * product(q.dual, inverse).tail<3>();
}

/// side   of the points' x: 1 where they are those of the left hand
void SkinnedHand::move(const Motions& motions, const Points& rest, double side, Points& vertices) const {
  vertices.resize(3, template_.cols());
  for (Eigen::Index v = 0; v < template_.cols(); ++v) {
    vertices.col(v) = placed(blended(motions, v), {side * rest(0, v), rest(1, v), rest(2, v)});
  }
  vertices.row(0) *= side_;
}

/// Unit normals that the faces have if their corners' motions turn them, over twice their area in the template.
Points SkinnedHand::expected_normals(const std::vector<DualQuaternion>& moves, const Triangles& triangles) const {
  Points normals(3, triangles.cols());
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    const Vector3 before = twice_area_vector(template_, triangles.col(f));
    Vector3 sum = Vector3::Zero();
    for (const int v : triangles.col(f)) {
      sum += rotated(moves[static_cast<std::size_t>(v)].real, before);
    }
    // The template is kept as the left hand's; the mirror image of a normal has its y and z turned round.
    sum.tail<2>() *= side_;
    normals.col(f) = sum / (sum.norm() * before.norm());
  }
  return normals;
}

std::vector<Eigen::Index> SkinnedHand::inverted_faces(const HandSkeleton& posed, const Points& vertices,
                                                      const Triangles& triangles) const {
  const Points expected = expected_normals(blended(motions_to(posed)), triangles);
  std::vector<Eigen::Index> inverted;
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    if (!(twice_area_vector(vertices, triangles.col(f)).dot(expected.col(f)) > 0)) {
      inverted.push_back(f);
    }
  }
  return inverted;
}

void SkinnedHand::pose(const HandSkeleton& posed, const Triangles& triangles, Points& vertices) const {
  std::vector<DualQuaternion> moves = blended(motions_to(posed));
  const auto place = [&](Eigen::Index v) {
    vertices.col(v) = placed(moves[static_cast<std::size_t>(v)], template_.col(v));
    vertices(0, v) *= side_;
  };
  vertices.resize(3, template_.cols());
  for (Eigen::Index v = 0; v < template_.cols(); ++v) {
    place(v);
  }
  const Points expected = expected_normals(moves, triangles);
  for (int round = 0; round < kMostRounds; ++round) {
    std::map<int, DualQuaternion> sums;
    for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
      const double facing = twice_area_vector(vertices, triangles.col(f)).dot(expected.col(f));
      if (facing >= kLeastFacing) {
        continue;
      }
      const auto move_of = [&](int corner) { return moves[static_cast<std::size_t>(triangles(corner, f))]; };
      const std::array<DualQuaternion, 3> corners = {move_of(0), move_of(1), move_of(2)};
      DualQuaternion together;
      for (const DualQuaternion& corner : corners) {
        together.add(corner, corner.real.dot(corners[0].real) < 0 ? -1.0 : 1.0);
      }
      // From 0 where a face begins to be mended, so that the skin of a hand that moves does not jump.
      const double pull = std::min(1.0 - facing / kLeastFacing, 1.0) / 3.0;
      for (std::size_t c = 0; c < 3; ++c) {
        sums.emplace(triangles(static_cast<int>(c), f), corners[c])
            .first->second.add(together, together.real.dot(corners[c].real) < 0 ? -pull : pull);
      }
    }
    if (sums.empty()) {
      return;
    }
    for (auto& [v, sum] : sums) {
      sum.normalize();
      moves[static_cast<std::size_t>(v)] = sum;
      place(v);
    }
  }
}

std::string SkinnedHand::part_of(Eigen::Index vertex) const {
  const std::size_t bone = influences_[starts_[static_cast<std::size_t>(vertex)]].bone;
  if (bone == kPalm) {
    return "palm";
  }
  return bone == kSwing ? bone_name(0, 0) : bone_name((bone - 1) / 3, (bone - 1) % 3);
}

}  // namespace touchfield
