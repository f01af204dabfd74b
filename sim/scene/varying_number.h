#pragma once

#include <functional>
#include <string>

#include "sim/scene/motion_curve.h"
#include "sim/scene/quantity.h"
#include "sim/scene/scene.h"

namespace touchfield {

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
