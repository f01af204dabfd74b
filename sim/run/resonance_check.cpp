#include "sim/run/resonance_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/model/evaluation_comparison.h"
#include "sim/run/speed.h"

namespace touchfield {

namespace {

constexpr double kTolerance = 1e-3;
constexpr int kMaxSteps = 60;
constexpr double kFreeSeconds = 0.25;  // spent on the resonance check whatever the run takes
constexpr double kShare = 0.5;         // of the run's own solving

}  // namespace

double resonance_check_seconds(bool plain, double product) { return (plain ? 15.0 : kMaxSteps) * product; }

bool has_cure(Scheme scheme) { return traits(scheme).burton_miller || traits(scheme).interior_points; }

bool wants_resonance_check(ResonanceCheck choice, double seconds, double spent) {
  return choice == ResonanceCheck::kAlways ||
         (choice == ResonanceCheck::kAuto && seconds <= std::max(kFreeSeconds, kShare * spent));
}

double resonance_difference(const SkinScattering& scattering, SkinScattering* cured, const SolverSpec& spec,
                            const Eigen::VectorXcd& drive, const Eigen::VectorXcd& own, double spent,
                            std::vector<SolveRecord>& records, Progress& progress) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  const TriangleMesh& mesh = scattering.system().mesh();
  const Wave& wave = scattering.system().wave();
  const bool plain = !traits(scattering.system().scheme()).burton_miller;
  SkinScattering* ready = plain ? cured : nullptr;
  const Scheme other =
      ready != nullptr ? ready->system().scheme() : (plain ? Scheme::kBurtonMiller : Scheme::kPaperCorrected);
  if (spec.resonance_check == ResonanceCheck::kNever) {
    return nothing;
  }
  const SolverKind kind = scattering.decision().options.kind;
  const bool by_grid = kind == SolverKind::kFft;
  SolverSpec quick = spec;
  quick.solver = by_grid ? SolverChoice::kFft : SolverChoice::kMatrixFree;
  quick.precision = by_grid ? PrecisionChoice::kAuto : PrecisionChoice::kSingle;
  quick.refine = false;
  quick.tolerance = kTolerance;
  quick.max_steps = kMaxSteps;
  const double share = product_share(kind, mesh.face_count(), solver_grid(grid_body(mesh), wave, quick).seconds);
  const double expected = resonance_check_seconds(plain, share * product_seconds(mesh, wave));
  if (!wants_resonance_check(spec.resonance_check, expected, spent)) {
    progress.detail(fmt::format(
        "  resonance check: skipped, {} would take about {:.1f} s more (solve.resonance_check: always requests it)",
        to_string(other), expected));
    return nothing;
  }
  const auto solved = [&] { return SkinScattering(mesh, wave, other, quick, scattering.array(), records, progress); };
  const Eigen::VectorXcd p =
      ready != nullptr ? ready->pressure(drive, "resonance_check") : solved().pressure(drive, "resonance_check");
  const Eigen::VectorXcd& reference = plain ? p : own;
  const double resonance_check = relative_difference(mesh.areas(), plain ? own : p, reference);
  const bool settled = records.back().residual <= 2.0 * kTolerance;
  progress.detail(fmt::format(
      "  resonance check: pressures of {} and {} differ by {:.2f} %{}", to_string(scattering.system().scheme()),
      to_string(other), 100.0 * resonance_check,
      settled ? "" : fmt::format(" ({} stopped at a residual of {:.1e})", to_string(other), records.back().residual)));
  return resonance_check;
}

}  // namespace touchfield
