#pragma once

#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// ". If 0.12 is in metres write 120" of a place or size of at most 2 mm, as those of hands, arrays and ears are not.
/// Empty where all is 0.
std::string metres_hint(const Vector3& length);

/// What of a scene is likely to be a slip, each "name: what, with the figure and the remedy":
///   unit_slip               numbers that make sense in another unit: phases of several turns, a source ten times
///                           as strong as others, pistons that overlap or are tiny, bodies below 0.5 mm, a field
///                           within 2 mm, a gas lighter than any
///   directivity_frequency   a directivity that was measured at another frequency
///   expected_dead           a method that expects far more dead channels than the array has
///
/// mesh   of the bodies
std::vector<std::string> scene_slips(const Scene& scene, const TransducerArray& array, double wavelength,
                                     const TriangleMesh& mesh);

}  // namespace touchfield
