#include "sim/run/solver_choice.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "sim/core/program_start.h"
#include "sim/gpu/gpu_library.h"
#include "sim/gpu/on_card.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kDoubleUpTo = 3000;  // unknowns: below, an LU in double takes about a second
constexpr double kMatrixShare = 0.5;        // of the free memory that a matrix may take
// Unknowns a right-hand side from which on matrix-free GMRES is cheaper than LU: 25 steps at 12 ms a column against
// 1.7 s, measured at 5,120 faces; the one grows with the square of the unknowns, the other with the cube.
constexpr Eigen::Index kUnknownsAColumn = 600;
constexpr double kGridPays = 0.8;  // of the time of direct products: the grid must be made first
constexpr double kPlainSteps = 200;
constexpr double kMillerSteps = 40;  // of hands, open and folded
constexpr double kTwoLevelSteps = 9;
// Of TwoLevel, on hands of 3,000 to 200,000 faces.
constexpr double kPointsAWave = 6.8;      // points per square wavelength of skin
constexpr double kPointsAFace = 0.7;      // of a coarse mesh, at most
constexpr double kEntrySeconds = 7e-9;    // of E, per face and point
constexpr double kFactorSeconds = 5e-11;  // of its LU, per cube of points
constexpr double kOverlapping = 1.5;      // points of a block and around it, over its own
constexpr double kFaceSeconds = 1.5e-5;   // of P and the filter, per face
constexpr double kAppliedSeconds = 5e-7;  // of a product with M, per face
// Entries of B times right-hand sides from which on a processor takes longer than a card's start.
constexpr double kCardPays = 5e8;
constexpr double kGridError = 0.11;  // of the tolerance, that products by a grid may be off by

bool single_grid_suits(const SolverSpec& spec) {
  return grid_tolerance(spec) >= kFinestSingleGrid && grid_tolerance(spec) <= kGridError * spec.tolerance;
}

}  // namespace

DeviceDecision choose_device(const SolverSpec& spec, Scheme scheme, Eigen::Index unknowns,
                             Eigen::Index right_hand_sides) {
  const bool asked = spec.device.kind == ComputeDevice::Kind::kCuda;
  if (spec.device.kind == ComputeDevice::Kind::kCpu) {
    return {std::nullopt, "as the scene asks"};
  }
  if (asked) {
    require_card(spec.device);
  }
  if (spec.solver == SolverChoice::kFft && !single_grid_suits(spec)) {
    return {std::nullopt, "only the processor solves by Fourier transforms to this tolerance"};
  }
  if (traits(scheme).interior_points || spec.precision == PrecisionChoice::kDouble || spec.tolerance < kFinestOnCard) {
    return {std::nullopt, "only the processor has this scheme, precision or tolerance"};
  }
  if (asked) {
    return {spec.device.card, "as the scene asks"};
  }
  const double entries = std::pow(static_cast<double>(unknowns), 2) * static_cast<double>(right_hand_sides);
  if (entries < kCardPays) {
    return {std::nullopt, "less work than starting the graphics card"};
  }
  if (const GpuLibrary& library = gpu_library(); library.cards == 0) {
    return {std::nullopt, library.why_none};
  }
  return {0, "more work than starting the graphics card"};
}

double grid_tolerance(const SolverSpec& spec) {
  const double tolerance = std::clamp(0.1 * spec.tolerance, kFinestGridTolerance, 1e-3);
  switch (spec.precision) {
    case PrecisionChoice::kSingle:
      return std::max(tolerance, kFinestSingleGrid);
    case PrecisionChoice::kDouble:
      return std::min(tolerance, 0.99 * kFinestSingleGrid);
    case PrecisionChoice::kAuto:
      break;
  }
  return tolerance;
}

SolverKind sums_on_card(const SolverSpec& spec, Eigen::Index unknowns) {
  const bool pays =
      spec.solver == SolverChoice::kFft || (spec.solver == SolverChoice::kAuto && unknowns >= kGridOnCard);
  return pays && single_grid_suits(spec) ? SolverKind::kFft : SolverKind::kMatrixFree;
}

double direct_seconds(Eigen::Index unknowns, Eigen::Index columns) {
  // 0.85 ns a pair; the more columns share its kernel, the less. Measured on hands of 5,000 to 21,000 faces.
  return (0.15e-9 + 0.7e-9 * std::pow(static_cast<double>(columns), -0.75)) *
         std::pow(static_cast<double>(unknowns), 2);
}

BodyCost body_cost(const GridBody& body, const Wave& wave, const SolverSpec& spec) {
  const double waves = body.area / (wave.wavelength() * wave.wavelength());
  return {choose_grid(body, wave.wavenumber(), spec.coupling / wave.k(), grid_tolerance(spec)),
          std::min(kPointsAWave * waves, kPointsAFace * body.faces)};
}

double two_level_seconds(Eigen::Index unknowns, double points) {
  const auto faces = static_cast<double>(unknowns);
  constexpr double kWhole = CoarseInverse::kWholePoints;
  constexpr double kOwn = CoarseInverse::kBlockPoints;
  const double block = points <= kWhole ? points : kOwn;
  const double columns = points <= kWhole ? points : kOverlapping * kOwn;
  return faces * (kEntrySeconds * columns + kFaceSeconds) + kFactorSeconds * points * block * block;
}

double expected_steps(Scheme scheme, bool two_level) {
  return two_level ? kTwoLevelSteps : (traits(scheme).burton_miller ? kMillerSteps : kPlainSteps);
}

double product_share(SolverKind kind, Eigen::Index unknowns, double by_grid) {
  return kind == SolverKind::kFft ? by_grid / direct_seconds(unknowns, 1) : 1.0;
}

SolverDecision choose_solver(const SolverSpec& spec, Scheme scheme, Eigen::Index unknowns, double available,
                             Eigen::Index right_hand_sides, const BodyCost& cost) {
  SolverDecision decision{{}, "as the scene asks"};
  SolverOptions& options = decision.options;
  options.tolerance = spec.tolerance;
  options.refine = spec.refine;
  options.max_steps = spec.max_steps;
  const bool small = unknowns <= kDoubleUpTo;
  const double matrix = (small ? 16.0 : 8.0) * std::pow(static_cast<double>(unknowns), 2);
  const bool fits = available <= 0 || matrix <= kMatrixShare * available;
  const double direct = direct_seconds(unknowns, right_hand_sides);
  const bool single_grid = grid_tolerance(spec) >= kFinestSingleGrid;
  const bool grid_suits = grid_tolerance(spec) <= kGridError * spec.tolerance || (spec.refine && !single_grid);
  const double by_grid = cost.grid.seconds;
  const bool grid_pays = grid_suits && by_grid < kGridPays * direct;
  const SolverKind iterative = grid_pays ? SolverKind::kFft : SolverKind::kMatrixFree;
  const auto columns = static_cast<double>(right_hand_sides);
  const double step = columns * (grid_pays ? by_grid : direct);
  const double plain_seconds = kMillerSteps * step;
  const double two_level = two_level_seconds(unknowns, cost.points) +
                           kTwoLevelSteps * (step + columns * kAppliedSeconds * static_cast<double>(unknowns));
  const bool two_level_pays = traits(scheme).burton_miller && two_level < plain_seconds;
  const double factorised = static_cast<double>(unknowns / kUnknownsAColumn + 1) * kMillerSteps *
                            (grid_pays ? direct_seconds(unknowns, 1) : direct);
  switch (spec.solver) {
    case SolverChoice::kLu:
      options.kind = SolverKind::kLu;
      break;
    case SolverChoice::kGmres:
      options.kind = SolverKind::kGmres;
      break;
    case SolverChoice::kMatrixFree:
      options.kind = SolverKind::kMatrixFree;
      break;
    case SolverChoice::kFft:
      options.kind = SolverKind::kFft;
      break;
    case SolverChoice::kAuto:
      if (traits(scheme).burton_miller && fits && factorised < std::min(plain_seconds, two_level)) {
        options.kind = SolverKind::kLu;
        decision.reason = "hundreds of right-hand sides share one factorisation";
      } else if (traits(scheme).burton_miller) {
        options.kind = iterative;
        decision.reason = grid_pays ? "this scheme takes few steps, and Fourier transforms make them cheap"
                                    : "this scheme takes few steps, and no matrix is stored";
      } else if (traits(scheme).interior_points) {
        options.kind = SolverKind::kLu;
        decision.reason = "iterations do not suit this scheme's equations";
      } else {
        options.kind = fits ? SolverKind::kLu : iterative;
        decision.reason = fits ? "this scheme may take hundreds of steps, and its matrix fits half of the free memory"
                               : "its matrix would take more than half of the free memory";
      }
      break;
  }
  options.two_level = two_level_pays && options.kind != SolverKind::kLu;
  if (options.two_level) {
    decision.reason += "; the two-level preconditioner saves more than it takes";
  }
  if (options.kind == SolverKind::kFft) {
    options.precision = single_grid ? Precision::kSingle : Precision::kDouble;
    return decision;
  }
  const bool in_double = spec.precision == PrecisionChoice::kAuto ? small && options.kind != SolverKind::kMatrixFree
                                                                  : spec.precision == PrecisionChoice::kDouble;
  options.precision = in_double ? Precision::kDouble : Precision::kSingle;
  return decision;
}

Eigen::Index largest_block(const Scene& scene, Scheme scheme, Eigen::Index channels, bool shared) {
  const SolveSpec& solve = scene.solve;
  constexpr Eigen::Index kUsualRank = 400;  // of 1,500 channels seen from a hand
  const bool transfer = std::any_of(solve.methods.begin(), solve.methods.end(), [&](const MethodSpec& method) {
    return method.kind->model == MethodModel::kSkin && method.scheme == scheme;
  });
  if (transfer || ((solve.optimality_bound || scene.write.transfer) && scheme == solve.scheme)) {
    return std::min(channels, kUsualRank);
  }
  return shared ? 2 * static_cast<Eigen::Index>(solve.methods.size()) : 1;
}

std::string solver_name(SolverKind kind, bool two_level) { return to_string(kind) + (two_level ? ", two-level" : ""); }

std::string precision_name(const SolverOptions& options) {
  if (options.precision == Precision::kDouble) {
    return "double";
  }
  return options.refine ? "single refined" : "single";
}

double available_memory() {
  std::ifstream meminfo("/proc/meminfo");
  std::string name;
  double kibibytes = 0;
  std::string unit;
  while (meminfo >> name >> kibibytes >> unit) {
    if (name == "MemAvailable:") {
      return std::min(1024.0 * kibibytes, memory_below_limit());
    }
  }
  return 0.0;
}

}  // namespace touchfield
