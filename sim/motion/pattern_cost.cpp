#include <algorithm>
#include <memory>
#include <variant>

#include "sim/core/require.h"
#include "sim/core/version.h"
#include "sim/motion/motion_instants.h"
#include "sim/motion/pattern.h"
#include "sim/run/check.h"
#include "sim/run/estimates.h"
#include "sim/run/methods.h"
#include "sim/run/result_warnings.h"
#include "solvers/phase/skin_rows.h"

namespace touchfield {

namespace {

constexpr double kMib = 1024.0 * 1024.0;
constexpr int kSampledFrames = 64;
constexpr double kTableCell = 150;        // bytes of a number on its way into a table
constexpr double kWrittenCell = 19;       // bytes of it there
constexpr double kProductsPerStep = 2.2;  // products of a step

/// A still with the pattern's method and nothing else.
Model as_still(const Model& model) {
  Model still = model;
  auto fixed = std::make_shared<FixedModel>(*model.fixed);
  const PatternSpec& spec = *fixed->scene.pattern;
  MethodSpec method;
  method.kind = spec.method;
  method.scheme = fixed->scene.solve.scheme;
  fixed->scene.solve.methods = {method};
  fixed->scene.solve.solver.resonance_check = ResonanceCheck::kNever;
  fixed->scene.solve.optimality_bound = false;
  fixed->scene.write.transfer = false;
  if (spec.pressure) {
    fixed->scene.target->pressure = spec.pressure;
    fixed->scene.target->quantity = TargetQuantity::kPressure;
    still.posture.target = fixed->scene.target;
  }
  fixed->evaluation = {};
  fixed->fields.clear();
  still.fixed = fixed;
  return still;
}

/// Seconds of a product with rows of so many faces and drives.
double step_seconds(Eigen::Index rows, Eigen::Index channels) {
  const SkinRows all(Eigen::MatrixXcd::Ones(rows, channels), Eigen::MatrixXcd(0, channels));
  const SkinMap map = all.map();
  const Eigen::VectorXcf q = Eigen::VectorXcf::Ones(channels);
  double seconds = HUGE_VAL;
  for (int trial = 0; trial < 10; ++trial) {
    const double begin = steady_now();
    map.sent_back(map.pressure(q));
    seconds = std::min(seconds, 0.5 * (steady_now() - begin));
  }
  return seconds;
}

}  // namespace

PatternCost pattern_cost(const Model& model) {
  const PatternSpec& spec = *model.fixed->scene.pattern;
  PatternCost cost{.clock = pattern_clock(spec)};
  const std::vector<PatternPoint> points = pattern_points(spec, model);
  PatternClock few = cost.clock;
  few.frames = std::min(few.frames, kSampledFrames);
  few.rate = few.frames / cost.clock.seconds();
  cost.faces = static_cast<Eigen::Index>(pattern_spots(spec, few, points, model).faces.size());
  const Model still = as_still(model);
  const CheckReport report = check_model(still);
  cost.warnings = clock_warnings(spec, cost.clock);
  if (std::string warning = spec.pressure ? reach_warning(still) : ""; !warning.empty()) {
    cost.warnings.push_back(std::move(warning));
  }
  cost.available_mib = report.available_mib;

  const Eigen::Index channels = model.fixed->array.size();
  const auto frames = static_cast<double>(cost.clock.frames);
  const auto n = static_cast<double>(channels);
  const auto u = static_cast<double>(cost.faces);
  const double moving = std::holds_alternative<std::monostate>(spec.path) ? 1.0 : frames;  // frames that are solved
  const double cells = 11.0 + 2.0 * static_cast<double>(points.size());
  const double drives = 16.0 * n * (spec.ring_up ? 3.0 : 2.0);
  const double of_faces = 8.0 * u * (spec.method->radiation ? 7.0 : 4.0);
  const auto patch = static_cast<double>(
      ((model.body.mesh.centroids().colwise() - points.back().at).colwise().norm().array() < SkinPatch::kReach)
          .count());
  cost.memory_mib =
      report.memory_mib +
      (frames * (drives + kTableCell * cells + sizeof(MotionFrame) + 8.0 * patch) + moving * of_faces) / kMib;
  const auto m = static_cast<double>(report.faces);
  constexpr double kMeshBytes = 60;    // of a face in HDF5
  constexpr double kInstantBytes = 3;  // of a face's pressure at an instant
  const double instants = std::min(frames, static_cast<double>(most_instants(report.faces, 1)));
  constexpr double kScoreColumns = 40;  // numbers of a frame and its score
  cost.files_mib = (frames * kWrittenCell * cells + (model.fixed->scene.write.h5
                                                         ? frames * (8.0 * (n + kScoreColumns) + 4.0 * patch) +
                                                               kMeshBytes * (m + n) + instants * kInstantBytes * m
                                                         : 0.0)) /
                   kMib;
  const double rows = u + expected_drives(model.body.mesh, model.fixed->array, model.fixed->wave.wavelength());
  cost.seconds = report.seconds + (moving - 1.0) * spec.iterations * kProductsPerStep *
                                      step_seconds(static_cast<Eigen::Index>(rows), channels);
  return cost;
}

void require_memory(const PatternCost& cost) {
  require(!(cost.available_mib > 0 && cost.memory_mib > cost.available_mib),
          "pattern: {} frames need about {:.1f} GiB of memory; {:.1f} GiB are free: lower pattern.frames_per_second or "
          "seconds, or choose a larger body.edge_mm",
          cost.clock.frames, cost.memory_mib / 1024.0, cost.available_mib / 1024.0);
}

}  // namespace touchfield
