#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sim/model/model.h"

namespace touchfield {

/// How a target box lies to the array.
struct BoxView {
  std::string part;           // of the target, as messages call it
  double cosine = 1.0;        // mean of normal . direction over the target, to the part of the array that it faces most
  double angle = 0.0;         // between the mean normal and that direction [rad]
  std::string body = "body";  // what messages call the body that most of the target is on
};

/// How a scene's bodies and target lie to its array, which tells that a result will be doubtful before any is computed.
struct ArrayView {
  std::optional<BoxView> worst;  // the box of least cosine; none without target faces that have a side
  Eigen::Index transducer = -1;  // the nearest to the skin
  double distance = std::numeric_limits<double>::infinity();  // of that one from the skin [m]; not looked for where
                                                              // none is nearer than kNearField wavelengths
};

inline constexpr double kFacing = 0.2;     // least cosine of a target that faces the array: 78 degrees if it is flat
inline constexpr double kNearField = 2.0;  // wavelengths

/// Parts of an array emit within 60 degrees of one another; those that make less than a tenth of the pressure at the
/// box do not count. So a target between two arrays that face each other has one of them before it. The direction to a
/// part is the mean of those to its transducers, weighted by the pressure that each makes at the box. A target over
/// both sides of a body, whose mean normal is shorter than 0.3, faces nothing.
ArrayView array_view(const Model& model);

/// "facing_away: ..." where the target does not face the array, else empty.
std::string facing_warning(const ArrayView& view);

/// "near_field: ..." where the skin is within kNearField wavelengths of a transducer, else empty.
std::string near_field_note(const ArrayView& view, const Model& model);

}  // namespace touchfield
