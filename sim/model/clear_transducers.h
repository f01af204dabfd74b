#pragma once

#include <optional>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/field/evaluate.h"
#include "sim/mesh/query/clearance.h"
#include "sim/model/bodies.h"

namespace touchfield {

inline constexpr double kLeastClearance = 1e-3;  // between a transducer and the skin [m]

/// Whether boxes about the transducers and the mesh are further apart than so much [m]: no question then of what lies
/// nearer.
bool lies_apart(const TransducerArray& array, const TriangleMesh& mesh, double distance);

/// Where a body and an array are in one place.
struct ArrayContact {
  Eigen::Index transducer = -1;         // in the body or nearer than kLeastClearance to it; -1: the board is
  double distance = 0;                  // of the transducer from the skin, negative inside [m]
  Eigen::Index face = -1;               // nearest of the body
  std::optional<PlateCollision> board;  // that the body crosses
};

/// A transducer inside a body or on its skin has no pressure there that means anything. Bodies cannot reach through the
/// boards that carry transducers either. Listed positions have no board, plane waves neither.
std::optional<ArrayContact> array_contact(const ArraySpec& spec, const TransducerArray& array,
                                          const TriangleMesh& mesh);

/// owner      M: number of the body a face is of
/// throws     InputError that names body.place.at_mm if a body meets the array
void require_clear_array(const ArraySpec& spec, const TransducerArray& array, const Posture& posture,
                         const TriangleMesh& mesh, const std::vector<int>& owner);

/// How many transducers point away from a place, although their directivity was measured ahead of them alone.
Eigen::Index count_behind(const TransducerArray& array, const Vector3& at);

/// throws   InputError that names a field of one point if it is in the body or nearer than 1 mm to a transducer
void require_clear_points(const std::vector<FieldGrid>& fields, const TransducerArray& array, const TriangleMesh& mesh);

/// The same before any body is meshed as the scene asks for it, from where the plan puts its shape.
///
/// kept   as of plan_bodies; may be null
void require_clear_places(const Scene& scene, const BodyPlan& plan, const TransducerArray& array, KeptBodies* kept);

}  // namespace touchfield
