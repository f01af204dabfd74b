#pragma once

#include <optional>
#include <string>

#include "sim/bem/scattering_solver.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// A scene's solver with what it leaves open decided by scheme, size and memory, and why.
struct SolverDecision {
  SolverOptions options;
  std::string reason;  // e.g. "chosen: few GMRES steps, no matrix to store"
};

/// Where a system is solved, and why there.
struct DeviceDecision {
  std::optional<int> card;  // none: on the processor
  std::string reason;
};

/// On the processor in any case: chief, a precision of `double`, a tolerance below kFinestOnCard. `auto` takes the first
/// card, if there is one, for work that is more than starting it takes (docs/gpu.md).
///
/// throws   NotBuiltError if a card is asked for that is not there
DeviceDecision choose_device(const SolverSpec& spec, Scheme scheme, Eigen::Index unknowns,
                             Eigen::Index right_hand_sides);

/// Rules for `auto`, in docs/user-guide.md:
///   burton_miller(_polished)   GMRES, matrix-free, in single precision; LU where there are so many right-hand sides
///                              that factorising once is cheaper and the matrix fits half of the free memory
///   chief                      LU
///   paper, paper_corrected     LU while the matrix fits half of the free memory, else GMRES, matrix-free
/// LU is in double up to 3,000 unknowns, beyond that in single; single precision is refined unless the scene says no.
///
/// available          memory that may be used [bytes]
/// right_hand_sides   of the largest block that will be solved for
SolverDecision choose_solver(const SolverSpec& spec, Scheme scheme, Eigen::Index unknowns, double available,
                             Eigen::Index right_hand_sides = 1);

/// The largest block of right-hand sides that a scheme's model will be asked for: about as many as there are drives
/// that span all channels where a method or the file that is written needs what every channel does, else 1.
///
/// shared   with other scenes: then all that a scene solves for, two right-hand sides a method, counts
Eigen::Index largest_block(const Scene& scene, Scheme scheme, Eigen::Index channels, bool shared = false);

/// How a solve's precision is called: single, single refined, double.
std::string precision_name(const SolverOptions& options);

/// Memory that can be had without swapping [bytes]; 0 if the system does not say.
double available_memory();

}  // namespace touchfield
