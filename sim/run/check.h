#pragma once

#include <optional>
#include <string>

#include "sim/core/json.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/model/model.h"
#include "sim/model/warnings.h"
#include "sim/run/solver_choice.h"

namespace touchfield {

/// What a scene would build and cost, without solving it.
struct CheckReport {
  Eigen::Index faces = 0;
  Eigen::Index channels = 0;
  Eigen::Index target_faces = 0;
  double epw_mean = 0;                    // wavelength over the mean edge
  double epw_min = 0;                     // wavelength over the longest edge
  MeshQuality quality;                    // against the edge lengths that the scene asks for, if it has one body
  std::optional<Resolution> near_target;  // of the faces within 15 mm of the target's centre
  double memory_mib = 0;                  // estimate of the run's peak
  double available_mib = 0;
  double seconds = 0;                 // estimate of the run, from what this machine does now on a small part of it
  std::string note;                   // empty, or why those seconds are a guess
  Eigen::Index evaluation_faces = 0;  // about, of an evaluation with a mesh of its own
  SolverDecision decision;            // how B p = b would be solved
};

/// sharing   how many scenes of a sweep share the body: a factorisation then pays earlier
CheckReport check_model(const Model& model, int sharing = 1);

/// Refuses a run that would not fit the memory that is free now.
/// throws   InputError naming the faces, what they need and what there is
void require_memory(const CheckReport& report);

/// What `check` says: medium, array, mesh, its faults and quality, target, solver, cost.
///
/// more   remarks beside those of the model
Json check_value(const Model& model, const CheckReport& report, const Remarks& more = {});

}  // namespace touchfield
