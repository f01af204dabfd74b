#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/scene/motion_spec.h"
#include "sim/scene/quantity.h"
#include "sim/scene/scene.h"

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

/// A number of a scene that may vary over a motion:
///   - a coordinate or an angle of a body's place
///   - an angle of a joint of the built-in hand
///   - a coordinate of a target box
///   - the wanted pressure
struct VaryingNumber {
  std::string path;  // as a sweep names it, numbers in brackets: body.place.at_mm[2]
  schema::Unit unit = schema::Unit::power_of_ten(0);
  schema::Range range{};  // in that unit
  /// Where it is in a scene or a posture of one [SI]. A joint that the scene leaves to the pose is given the pose's
  /// angle first.
  /// throws   InputError if it is not in this scene
  std::function<double&(Posture&)> in;
};

/// The paths there are, as a message or a page lists them.
std::string varying_paths();

/// The number that a path names; items of lists as [2] or .2.
/// throws   InputError that lists the paths there are
VaryingNumber varying_number(const std::string& path);

/// How a number of a scene runs over its motion, in SI units.
///
/// scene    which has the number; angles of its pose are written into it
/// throws   InputError that names path, time and value if it leaves its range, or as VaryingNumber::in
MotionCurve motion_curve(const VaryingNumber& number, const MotionLaw& law, double seconds, Scene& scene);

}  // namespace touchfield
