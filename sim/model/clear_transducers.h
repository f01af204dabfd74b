#pragma once

#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/field/evaluate.h"
#include "sim/model/bodies.h"

namespace touchfield {

inline constexpr double kLeastClearance = 1e-3;  // between a transducer and the skin [m]

/// Whether boxes about the transducers and the mesh are further apart than so much [m]: no question then of what lies
/// nearer.
bool lies_apart(const TransducerArray& array, const TriangleMesh& mesh, double distance);

/// A transducer inside a body or on its skin has no pressure there that means anything.
///
/// array      not a plane wave
/// owner      M: number of the body a face is of
/// throws     InputError that names body.place.at_mm if a transducer is in the mesh or nearer than 1 mm to it
void require_clear_transducers(const Posture& posture, const TransducerArray& array, const TriangleMesh& mesh,
                               const std::vector<int>& owner);

/// throws   InputError that names a field of one point if it is in the body or nearer than 1 mm to a transducer
void require_clear_points(const std::vector<FieldGrid>& fields, const TransducerArray& array, const TriangleMesh& mesh);

/// The same before any body is meshed as the scene asks for it, from where the plan puts its shape.
///
/// kept   as of plan_bodies; may be null
void require_clear_places(const Scene& scene, const BodyPlan& plan, const TransducerArray& array, KeptBodies* kept);

}  // namespace touchfield
