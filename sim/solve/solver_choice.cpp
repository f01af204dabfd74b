#include "sim/solve/solver_choice.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>

#include "sim/gpu/body_on_card.h"
#include "sim/gpu/gpu_library.h"
#include "solvers/linear/system_limits.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kDoubleUpTo = 3000;  // unknowns: below, an LU in double takes about a second
constexpr double kMatrixShare = 0.5;        // of the free memory that a matrix may take
// Unknowns a right-hand side from which on GMRES is cheaper than LU: 25 steps at 12 ms a column against 1.7 s, measured
// at 5,120 faces; the one grows with the square of the unknowns, the other with the cube.
constexpr Eigen::Index kUnknownsAColumn = 600;
// Entries of B times right-hand sides from which on a processor takes longer than a card's start.
constexpr double kCardPays = 5e8;

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
  if (traits(scheme).interior_points || spec.precision == PrecisionChoice::kDouble || spec.tolerance < kFinestOnCard) {
    return {std::nullopt, "only the processor knows this scheme, precision or tolerance"};
  }
  if (asked) {
    return {spec.device.card, "as the scene asks"};
  }
  const double entries = std::pow(static_cast<double>(unknowns), 2) * static_cast<double>(right_hand_sides);
  if (entries < kCardPays) {
    return {std::nullopt, "less work than a graphics card's start"};
  }
  if (const GpuLibrary& library = gpu_library(); library.cards == 0) {
    return {std::nullopt, library.why_none};
  }
  return {0, "more work than a graphics card's start"};
}

SolverDecision choose_solver(const SolverSpec& spec, Scheme scheme, Eigen::Index unknowns, double available,
                             Eigen::Index right_hand_sides) {
  SolverDecision decision{{}, "as the scene asks"};
  SolverOptions& options = decision.options;
  options.tolerance = spec.tolerance;
  options.refine = spec.refine;
  options.max_steps = spec.max_steps;
  const bool small = unknowns <= kDoubleUpTo;
  const double matrix = (small ? 16.0 : 8.0) * std::pow(static_cast<double>(unknowns), 2);
  const bool fits = available <= 0 || matrix <= kMatrixShare * available;
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
    case SolverChoice::kAuto:
      if (traits(scheme).burton_miller && fits && right_hand_sides > unknowns / kUnknownsAColumn + 1) {
        options.kind = SolverKind::kLu;
        decision.reason = "hundreds of right-hand sides share one factorisation";
      } else if (traits(scheme).burton_miller) {
        options.kind = SolverKind::kMatrixFree;
        decision.reason = "this scheme takes few steps, and no matrix is stored";
      } else if (traits(scheme).interior_points) {
        options.kind = SolverKind::kLu;
        decision.reason = "this scheme's equations suit no iteration";
      } else {
        options.kind = fits ? SolverKind::kLu : SolverKind::kMatrixFree;
        decision.reason = fits ? "this scheme may take hundreds of steps, and its matrix fits half of the free memory"
                               : "its matrix would take more than half of the free memory";
      }
      break;
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
  if (transfer || ((solve.certificate || scene.write.transfer) && scheme == solve.scheme)) {
    return std::min(channels, kUsualRank);
  }
  return shared ? 2 * static_cast<Eigen::Index>(solve.methods.size()) : 1;
}

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
