#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sim/model/model.h"

namespace touchfield {

/// What is to be said of a result beside its numbers, each line "name: what, with the figure".
struct Remarks {
  std::vector<std::string> warnings;  // what makes it less than trustworthy
  std::vector<std::string> notes;     // what is worth knowing besides
};

/// How the note of a hand without forearm begins.
inline constexpr const char* kHandAlone = "hand_alone: ";

/// Appends remarks to others.
void add(const Remarks& more, Remarks& remarks);

/// What a model says of its results. docs/stability.md says what was measured on such cases. Where an evaluation has
/// bodies meshed again, the solving mesh counts within 15 mm of the target alone (coarse_mesh, slivers, size_jump,
/// narrow_gap, thin_body).
///
/// Warnings:
///   mesh_unit       a mesh file in a unit that makes it no body of a person
///   cutting_faces   faces of the body cut each other
///   coarse_mesh     too few edges per wavelength: below 3 by the mean face; or, on a twentieth of the skin, below 2
///                   anywhere or below 2.5 within 15 mm of the target; what it says is the worse the fewer they are
///   slivers         an angle below 10 degrees
///   size_jump       faces that share an edge differ more than 3 times in size
///   narrow_gap      two parts of the skin look at each other through less than one edge of air
///   thin_body       the same through less than two edges of the body
///   array_pitch     two transducers nearer than an eighth of a wavelength
///   array_size      an array more than 2 m across
///   unit_slip, directivity_frequency, expected_dead   scene_slips
///   behind_array    more than half of the transducers, which radiate ahead, point away from the target or the body
///   near_source     a transducer nearer to the skin than a local edge
///   both_sides      a target box holds two sides of a body: more than a tenth of its faces look at each other through
///                   it
///   facing_away     the target's mean normal is more than 78 degrees from the direction to the array (ArrayView)
///   shadowed_skin     another body hides more than a twentieth of the skin beyond keep_within from the array
/// Notes:
///   landmark_off      a landmark that the scene gives for a mesh is 3 mm or more off its skin
///   near_field        the skin is within 2 wavelengths of a transducer
///   evaluated_by_itself  the pattern was found on the very mesh and scheme that it is evaluated on
///   beyond            keep_within cuts a body, the rest of whose skin counts by its incident pressure
///   hand_alone        a hand has no forearm: the phases know nothing of an arm, and no figure counts it
///   forearm           the scene does not say how long a hand's forearm is; release 0.3 took a hand alone
///   still             the scene's motion is left out: the results are of its other keys as they stand
Remarks model_remarks(const Model& model);
/// The same without `still`: of a motion as it begins.
Remarks played_remarks(const Model& model);

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
