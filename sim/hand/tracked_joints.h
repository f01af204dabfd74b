#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace touchfield {

/// The joints that OpenXR has of a hand, in its order.
inline constexpr std::array kOpenXrJoints = {"palm",
                                             "wrist",
                                             "thumb_metacarpal",
                                             "thumb_proximal",
                                             "thumb_distal",
                                             "thumb_tip",
                                             "index_metacarpal",
                                             "index_proximal",
                                             "index_intermediate",
                                             "index_distal",
                                             "index_tip",
                                             "middle_metacarpal",
                                             "middle_proximal",
                                             "middle_intermediate",
                                             "middle_distal",
                                             "middle_tip",
                                             "ring_metacarpal",
                                             "ring_proximal",
                                             "ring_intermediate",
                                             "ring_distal",
                                             "ring_tip",
                                             "little_metacarpal",
                                             "little_proximal",
                                             "little_intermediate",
                                             "little_distal",
                                             "little_tip"};

/// Whether a joint says where the built-in hand is: the wrist, three of the thumb, four of each finger. The palm and
/// the metacarpals (the joints at their bases) lie inside the rigid palm, where trackers put them differently.
constexpr bool is_tracked(std::string_view joint) { return joint != "palm" && !joint.ends_with("_metacarpal"); }

/// Those, in the same order.
inline std::vector<std::string> tracked_joints() {
  std::vector<std::string> names;
  for (const std::string joint : kOpenXrJoints) {
    if (is_tracked(joint)) {
      names.push_back(joint);
    }
  }
  return names;
}

}  // namespace touchfield
