#include "sim/hand/hand_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/hand/hand_flesh.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/self_intersections.h"

namespace touchfield {

namespace {

constexpr double kStill = 0.5e-3;  // [m]
constexpr double kMostWebTurn = 75 * kDegree;
constexpr double kMostThumbFlexion = 22 * kDegree;
constexpr double kMostThumbTwist = 100 * kDegree;

Vector3 seen_from(const BoneChain& chain, std::size_t bone, const Vector3& x) {
  const Vector3 along = chain.direction(static_cast<int>(bone));
  const Vector3 from = x - chain.joints[bone];
  return {from.dot(along.cross(chain.palmar[bone])), from.dot(along), from.dot(chain.palmar[bone])};
}

}  // namespace

std::string contact_text(const HandContact& contact) {
  const char* what = "";
  switch (contact.kind) {
    case ContactKind::kMet:
      what = "come into contact";
      break;
    case ContactKind::kMoved:
      what = "touch in the pose that was meshed and move against each other";
      break;
    case ContactKind::kStretched:
      what = "turn farther against each other than the skin of the pose that was meshed follows,";
      break;
    case ContactKind::kFolded:
      what = "press the skin between them into a fold that intersects itself";
      break;
  }
  return fmt::format("{} and {} {} at {} of the hand's own frame", contact.first, contact.second, what,
                     place_text(contact.at));
}

HandContacts::HandContacts(const HandSkeleton& made_in, HandSide side)
    : made_in_(made_in), side_(mirror_sign(side)), palm_({palm_flesh(made_in)}), before_(balls_of(made_in)) {}

std::vector<HandContacts::Ball> HandContacts::balls_of(const HandSkeleton& hand) {
  constexpr std::size_t kBalls = 8;  // a bone
  constexpr double kFlesh = 1.03;    // pads and blends reach beyond the skeleton's radii
  std::vector<Ball> balls;
  for (std::size_t digit = 0; digit < HandSkeleton::kDigits; ++digit) {
    const BoneChain& chain = hand.digit(digit);
    for (std::size_t bone = 0; bone < 3; ++bone) {
      // The last ball ends where the tip does.
      const double length = (chain.joints[bone + 1] - chain.joints[bone]).norm();
      const double end = bone == 2 ? 1.0 - chain.radii[3] / length : 1.0;
      for (std::size_t k = 0; k < kBalls; ++k) {
        const double share = (static_cast<double>(k) + (bone == 2 ? 1.0 : 0.5)) / kBalls;
        const double radius = chain.radii[bone] + share * (chain.radii[bone + 1] - chain.radii[bone]);
        Vector3 centre = chain.along(static_cast<int>(bone), share * end);
        if (digit == 0 && bone == 0 && share < 0.5) {
          centre += 0.07 * hand.breadth * chain.palmar[0];  // the ball of the thumb
        }
        balls.push_back({digit, bone, static_cast<double>(bone) + share * end, centre, kFlesh * radius});
      }
    }
  }
  return balls;
}

bool HandContacts::one_flesh(const Ball& ball, const Ball& later) {
  if (ball.digit == later.digit) {
    return later.along - ball.along < 1.5 || ball.along < 0.3;
  }
  if (ball.digit == 0) {
    return ball.along < 0.7 && later.along < 0.5;
  }
  return later.digit == ball.digit + 1 && std::max(ball.along, later.along) < 0.5;
}

bool HandContacts::one_flesh_with_palm(const Ball& ball) { return ball.along < (ball.digit == 0 ? 0.6 : 0.7); }

std::optional<HandContact> HandContacts::at(const HandSkeleton& posed) const {
  const std::vector<Ball> now = balls_of(posed);
  std::optional<HandContact> nearest;
  double least = std::numeric_limits<double>::infinity();
  const auto offer = [&](double was, double gap, bool moved, const std::string& first, const std::string& second,
                         const Vector3& where) {
    const bool touched = was < kLeastHandGap;
    if ((touched ? moved : gap < kLeastHandGap) && gap < least) {
      least = gap;
      nearest = {
          touched ? ContactKind::kMoved : ContactKind::kMet, first, second, {side_ * where.x(), where.y(), where.z()}};
    }
  };
  for (std::size_t i = 0; i < now.size(); ++i) {
    const Ball& a = now[i];
    if (!one_flesh_with_palm(a)) {
      const bool moved = (a.centre - before_[i].centre).norm() > kStill;
      offer(palm_gap(before_[i]), palm_gap(a), moved, name_of(a), "palm", a.centre);
    }
    for (std::size_t j = i + 1; j < now.size(); ++j) {
      const Ball& b = now[j];
      const double touching = a.radius + b.radius;
      const double was = (before_[j].centre - before_[i].centre).norm() - touching;
      const double gap = (b.centre - a.centre).norm() - touching;
      if (one_flesh(a, b) || std::min(was, gap) >= kLeastHandGap) {
        continue;
      }
      const Vector3 shift = seen_from(posed.digit(a.digit), a.bone, b.centre) -
                            seen_from(made_in_.digit(a.digit), a.bone, before_[j].centre);
      offer(was, gap, shift.norm() > kStill, name_of(a), name_of(b), 0.5 * (a.centre + b.centre));
    }
  }
  for (std::size_t i = 1; i < HandSkeleton::kDigits; ++i) {
    const BoneChain& finger = posed.digit(i);
    const BoneChain& before = made_in_.digit(i);
    const bool moved = (finger.joints[3] - before.joints[3]).norm() > kStill;
    if (curled(finger) != curled(before) || (curled(finger) && moved)) {
      offer(curled(before) ? 0.0 : kLeastHandGap, 0.0, moved, bone_name(i, 2), bone_name(i, 0), finger.joints[3]);
    }
  }
  return nearest ? nearest : stretched(posed);
}

std::optional<HandContact> HandContacts::stretched(const HandSkeleton& posed) const {
  const auto found = [&](const std::string& first, const std::string& second, const Vector3& x) {
    return HandContact{ContactKind::kStretched, first, second, {side_ * x.x(), x.y(), x.z()}};
  };
  // How far the metacarpal has left what lay along it, to its palm side.
  if (posed.thumb.palmar[0].dot(made_in_.thumb.direction(0)) < -std::sin(kMostThumbFlexion) ||
      angle_between(posed.thumb.palmar[0], made_in_.thumb.palmar[0]) > kMostThumbTwist) {
    return found(bone_name(0, 0), "palm", posed.thumb.joints[0]);
  }
  for (std::size_t i = 1; i + 1 < HandSkeleton::kDigits; ++i) {
    const auto one_from_other = [i](const HandSkeleton& hand) {
      return angle_between(hand.digit(i).direction(0), hand.digit(i + 1).direction(0));
    };
    if (std::abs(one_from_other(posed) - one_from_other(made_in_)) > kMostWebTurn) {
      return found(bone_name(i, 0), bone_name(i + 1, 0),
                   0.5 * (posed.digit(i).joints[0] + posed.digit(i + 1).joints[0]));
    }
  }
  return std::nullopt;
}

std::optional<HandContact> fold_of(const SkinnedHand& skin, const HandSkeleton& posed, const Points& vertices,
                                   const Triangles& triangles) {
  const auto between = [&](Eigen::Index f, Eigen::Index g) {
    const Vector3 at = vertices(Eigen::all, triangles.col(f)).rowwise().mean();
    return HandContact{ContactKind::kFolded, skin.part_of(triangles(0, f)), skin.part_of(triangles(0, g)), at};
  };
  if (const auto pairs = self_intersections(TriangleMesh(vertices, triangles), 1); !pairs.empty()) {
    return between(pairs.front().first, pairs.front().second);
  }
  const std::vector<Eigen::Index> inverted = skin.inverted_faces(posed, vertices, triangles);
  return inverted.empty() ? std::nullopt : std::optional(between(inverted.front(), inverted.front()));
}

}  // namespace touchfield
