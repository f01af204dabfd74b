#pragma once

#include <vector>

#include "sim/scene/motion_spec.h"

namespace touchfield {

/// A number over time, by its law.
///
/// Keys are joined by piecewise cubic Hermite polynomials that preserve the monotony of their data. An inner slope is
/// the weighted harmonic mean of the slopes of its two chords, or 0 where these differ in sign. Slopes at the ends
/// follow from three points and are limited. A key is met exactly, and no value lies outside those of the two keys
/// round it. The error on a smooth monotone function is of third order in the distance of keys.
///
/// source   F. N. Fritsch, R. E. Carlson 1980; F. N. Fritsch, J. Butland 1984
class MotionCurve {
 public:
  /// law    of keys: 1 or more, in the order of their times
  /// own    the number's value in the scene
  MotionCurve(MotionLaw law, double own);

  double operator()(double seconds) const;

  /// Times from 0 to `seconds`, in order, among which are both ends and those of the least and the greatest value.
  std::vector<double> turns(double seconds) const;

 private:
  double at(const SineLaw& law, double seconds) const;
  double at(const KeysLaw& law, double seconds) const;
  double at(const RateLaw& law, double seconds) const;

  MotionLaw law_;
  double own_;
  std::vector<double> slopes_;  // at the keys
};

}  // namespace touchfield
