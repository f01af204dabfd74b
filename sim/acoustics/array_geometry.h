#pragma once

#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"

namespace touchfield {

/// Where the transducers of an array sit.
struct ArrayGeometry {
  Vector3 size;                  // of the box around them, along the axes of their frame [m]
  double least_pitch = 0;        // least distance between two of them [m]; 0 of one transducer
  double largest_pitch = 0;      // largest distance of one to its nearest neighbour [m]
  Eigen::Index nearest[2] = {};  // the two that are least_pitch apart
  Vector3 facing;                // mean of their axes
};

/// Takes n log n steps.
/// throws   std::logic_error on a plane wave
ArrayGeometry array_geometry(const TransducerArray& array);

/// Two transducers nearer than this, or than an eighth of a wavelength if that is less, are a slip [m].
inline constexpr double kLeastPitch = 1e-3;
/// An array larger than this is a slip [m].
inline constexpr double kLargestArray = 20;

/// Refuses an array that nobody can have built: two transducers in one place or nearer than kLeastPitch, or more than
/// kLargestArray across. A plane wave passes.
///
/// field    of the scene, for the message: "array.grid"
/// advice   what to look at: "is pitch_mm in mm?"
/// throws   InputError naming the two transducers, or the size
void require_real_array(const TransducerArray& array, double wavelength, const std::string& field,
                        const std::string& advice);

/// What is likely to be a slip, each "name: what, with the figure":
///   array_pitch   two transducers nearer than an eighth of a wavelength
///   array_size    more than 2 m across
std::vector<std::string> array_warnings(const TransducerArray& array, double wavelength);

/// "256 transducers, 157.5 x 157.5 mm, pitch 10.5 mm, facing +z", for a person.
std::string describe_array(const TransducerArray& array);

}  // namespace touchfield
