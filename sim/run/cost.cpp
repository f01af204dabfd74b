#include "sim/run/cost.h"

#include <algorithm>
#include <cmath>

#include "sim/run/speed.h"

namespace touchfield {

namespace {

constexpr double kLuFlops = 8.0 / 3.0;  // complex operations counted as real ones, times n^3
constexpr double kNearPairs = 220;      // a face, of Burton-Miller's near corrections on a uniform mesh
constexpr double kNearBytes = 24;       // a pair, while they are gathered
constexpr double kNearCost = 500;       // of a near pair, in double, over one pair of a product in single precision
constexpr double kMillerCost = 1.3;     // of a product with W over one with D alone

}  // namespace

double near_memory(double faces) { return kNearBytes * kNearPairs * faces; }

ModelCost scattering_cost(const SolverDecision& decision, Scheme scheme, double faces, double unknowns, double solves,
                          double steps, double product, const GridChoice& grid) {
  ModelCost cost;
  const SolverOptions& options = decision.options;
  cost.bytes = solver_memory(static_cast<Eigen::Index>(unknowns), options, 1);
  const bool miller = traits(scheme).burton_miller;
  if (miller) {
    cost.bytes += near_memory(faces);
    cost.seconds += kNearCost * kNearPairs * product / faces;
  }
  if (traits(scheme).interior_points) {
    cost.bytes += 16.0 * faces * (unknowns - faces);
  }
  const double in_double = 2.2 * product * (miller ? kMillerCost : 1.0);  // the residual
  if (options.kind == SolverKind::kLu) {
    const double speed = options.precision == Precision::kSingle ? 1.9 : 1.0;
    const Speed& measured = measured_speed(unknowns);
    cost.seconds += kLuFlops * unknowns * unknowns * unknowns / (speed * measured.flops) + in_double * solves;
    cost.note = measured.note;
  } else if (options.kind == SolverKind::kFft) {
    const double share = product_share(options.kind, static_cast<Eigen::Index>(unknowns), grid.seconds);
    constexpr double kOnce = 3.0;    // to make the grid, in products
    constexpr double kRounds = 3.0;  // of refinement, beyond what grids reach
    cost.bytes += grid.memory;
    cost.seconds += options.tolerance < 5.0 * kFinestGridTolerance ? kRounds * solves * in_double : 0.0;
    cost.seconds += (solves * steps + kOnce) * share * product * kMillerCost;
  } else {
    const double step = options.precision == Precision::kSingle ? product * (miller ? kMillerCost : 1.0) : in_double;
    cost.seconds += solves * (steps * step + in_double);
  }
  return cost;
}

double chief_points(const Model& model) {
  const double spacing = SystemOptions{}.chief_spacing * model.fixed->wave.wavelength();
  return std::max(0.0, model.fixed->report.volume) / std::pow(spacing, 3);
}

}  // namespace touchfield
