#pragma once

#include <limits>
#include <optional>
#include <string>

#include "sim/bem/grid_spec.h"
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

/// On the processor in any case: chief, a precision of `double`, a tolerance below kFinestOnCard. Fourier transforms
/// also where grids in single precision do not reach the tolerance. `auto` takes the first card, if there is one, for
/// work that is more than starting it takes (docs/gpu.md).
///
/// throws   NotBuiltError if a card is asked for that is not there
DeviceDecision choose_device(const SolverSpec& spec, Scheme scheme, Eigen::Index unknowns,
                             Eigen::Index right_hand_sides);

/// Accuracy of products by a grid with which a solution reaches the tolerance. It is a tenth of the tolerance, at most
/// 1e-3, and within what grids can do in the precision that is asked for. It decides the precision of the grid.
double grid_tolerance(const SolverSpec& spec);

/// How the sums of a body on a card may go: kFft by a grid too, else kMatrixFree.
SolverKind sums_on_card(const SolverSpec& spec, Eigen::Index unknowns);

/// Seconds that one thread takes for the product of a body's matrix with a block, per column. The product is summed
/// pair by pair in single precision, on a processor of 2020.
double direct_seconds(Eigen::Index unknowns, Eigen::Index columns);

/// What else the solver of a body is chosen by. Without a body: neither a grid nor a preconditioner.
struct BodyCost {
  GridChoice grid{.seconds = std::numeric_limits<double>::infinity()};  // of products by a grid
  double points = std::numeric_limits<double>::infinity();              // of TwoLevel's coarse space, within a tenth
};
BodyCost body_cost(const GridBody& body, const Wave& wave, const SolverSpec& spec);

/// Seconds to make a TwoLevel, as those of direct_seconds().
double two_level_seconds(Eigen::Index unknowns, double points);

/// Steps that GMRES takes for one drive to 1e-4. Two-level: 7 to 12. Burton-Miller's equation without: 20 to 40 on an
/// open hand, 50 to 110 on a folded one, more on finer meshes. Plain equations: up to hundreds.
double expected_steps(Scheme scheme, bool two_level);

/// What a product takes by the way that a solver multiplies, over a direct one.
///
/// by_grid   seconds of the grid of body_cost()
double product_share(SolverKind kind, Eigen::Index unknowns, double by_grid);

/// Rules for `auto`:
///   burton_miller(_polished)   GMRES in single precision, with products by a grid where those are faster, else
///                              matrix-free; with TwoLevel where it saves more than it takes to make; LU where there
///                              are so many right-hand sides that factorising once is cheaper and the matrix fits half
///                              of the free memory
///   chief                      LU
///   paper, paper_corrected     LU while the matrix fits half of the free memory, else GMRES as above
/// LU is in double up to 3,000 unknowns, beyond that in single; single precision is refined unless the scene says no.
///
/// available          memory that may be used [bytes]
/// right_hand_sides   of the largest block that will be solved for
/// cost               body_cost() of the body
SolverDecision choose_solver(const SolverSpec& spec, Scheme scheme, Eigen::Index unknowns, double available,
                             Eigen::Index right_hand_sides = 1, const BodyCost& cost = {});

/// The largest block of right-hand sides that a scheme's model will be asked for. It is about as large as a basis of
/// all channels where a method, the optimality bound or the written file needs the effect of every channel. Else it is
/// 1.
///
/// shared   with other scenes: then all that a scene solves for, two right-hand sides per method, counts
Eigen::Index largest_block(const Scene& scene, Scheme scheme, Eigen::Index channels, bool shared = false);

/// How a solve's solver is called: that of its kind, then ", two-level" where it is preconditioned.
std::string solver_name(SolverKind kind, bool two_level);

/// How a solve's precision is called: single, single refined, double.
std::string precision_name(const SolverOptions& options);

/// Memory that can be had without swapping [bytes]; 0 if the system does not say.
double available_memory();

}  // namespace touchfield
