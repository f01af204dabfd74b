#pragma once

#include <vector>

#include "sim/cameras/hand_points.h"

namespace touchfield {

/// Points of a skin and its normals there.
struct SkinSamples {
  Points at;      // 3 x S [m]
  Points normal;  // 3 x S, unit

  SkinSamples part(const std::vector<Eigen::Index>& which) const {
    return {at(Eigen::all, which), normal(Eigen::all, which)};
  }
  /// Every k-th, k the whole part of S / most or 1: fewer than 2 `most`.
  SkinSamples thinned(Eigen::Index most) const;
};

/// The mean of what was seen in each cube of 8 mm, cube by cube.
SkinSamples thinned_evenly(const HandPoints& points);

/// Connected parts: in cubes of 15 mm that touch. The largest first, four at most, of 20 points at least.
std::vector<SkinSamples> parts_of(const SkinSamples& samples);

/// What of a part a hand would have been seen at.
struct PossibleHand {
  SkinSamples samples;
  int where;  // 0 the whole part, 1 and 2 its ends along the longest axis
};

/// A part as a whole, if it is not longer than 260 mm, and its ends. Ends are 190 mm (a hand) and 120 mm (a fist) long.
/// An end is taken only if the part is longer than it by a tenth. The order is by `where`.
std::vector<PossibleHand> possible_hands(const SkinSamples& part);

/// Columns: across, along the longest axis, along the shortest; a rotation.
Eigen::Matrix3d principal_axes(const Points& at);

}  // namespace touchfield
