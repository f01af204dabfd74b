#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/hand/implicit_surface.h"
#include "sim/hand/skinned_hand.h"

namespace touchfield {

enum class ContactKind {
  kMet,        // apart in the template, now nearer than what merges (2.6 mm)
  kMoved,      // touching in the template, moved against each other by more than 0.5 mm since
  kStretched,  // turned against each other farther than their skin follows
  kFolded,     // the skin cuts itself or a face is inverted
};

/// Two parts of a hand that skinning cannot take to a pose.
struct HandContact {
  ContactKind kind;
  std::string first;  // as bone_name, or "palm"
  std::string second;
  Vector3 at;  // between them, in the hand's own frame [m]
};

/// "middle phalanx of the .. and palm come into contact at (..) mm of the hand's own frame".
std::string contact_text(const HandContact& contact);

/// Whether a pose can be reached with the triangles of the template. Three things must not happen:
///
///   - parts that are apart in the template come into contact
///   - parts that touch in the template move against each other
///   - parts turn so far against each other that the skin between them loses its shape
///
/// Proximal phalanges next to each other may turn by 75 degrees against each other. The thumb's metacarpal may turn by
/// 22 degrees to its palm side, and this side itself by 100 degrees. Beyond, skin cuts itself at the webs, and that of
/// the thumb loses over 3 % of the hand's volume.
///
/// The digits count as rows of balls of the skeleton's radii and 3 % more, 5 mm apart or less. The palm counts as its
/// own flesh. A finger that is bent so far that its inside fills with flesh has come into contact with itself. Webs and
/// whatever else is one flesh in every pose do not count.
class HandContacts {
 public:
  explicit HandContacts(const HandSkeleton& made_in, HandSide side = HandSide::kRight);

  /// The parts that are nearest to each other, or else those stretched; nothing if the pose is free. 0.1 ms.
  std::optional<HandContact> at(const HandSkeleton& posed) const;

 private:
  /// A ball of a digit's flesh.
  struct Ball {
    std::size_t digit;
    std::size_t bone;
    double along;  // in bones from the base
    Vector3 centre;
    double radius;
  };
  static std::vector<Ball> balls_of(const HandSkeleton& hand);
  static bool one_flesh(const Ball& ball, const Ball& later);
  static bool one_flesh_with_palm(const Ball& ball);
  static std::string name_of(const Ball& ball) { return bone_name(ball.digit, ball.bone); }
  std::optional<HandContact> stretched(const HandSkeleton& posed) const;
  double palm_gap(const Ball& ball) const { return palm_.distance(ball.centre) - ball.radius; }

  HandSkeleton made_in_;
  double side_;
  SoftBody palm_;
  std::vector<Ball> before_;  // in the template
};

/// Where the skin itself shows that it cannot be taken to a pose: the first faces that cut each other, else the first
/// that is inverted. Some ms for 4,000 faces; to be asked where HandContacts finds nothing.
///
/// vertices    3 x V as skin.pose(posed, triangles, ..) left them
/// triangles   3 x M
std::optional<HandContact> fold_of(const SkinnedHand& skin, const HandSkeleton& posed, const Points& vertices,
                                   const Triangles& triangles);

}  // namespace touchfield
