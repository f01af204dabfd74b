#include "sim/run/estimates.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/layer_sum.h"
#include "sim/bem/scattering_solver.h"
#include "sim/bem/scattering_system.h"
#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/mesh/query/interior_points.h"
#include "sim/mesh/topology.h"
#include "sim/model/evaluation.h"
#include "sim/run/skin_scattering.h"
#include "solvers/linear/factorisations.h"

namespace touchfield {

namespace {

template <typename Work>
double seconds_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Speed measure_lu(Eigen::Index size) {
  // Entries of length one without a pattern, and a diagonal that outweighs its row: far from singular.
  Eigen::MatrixXcd matrix(size, size);
  for (Eigen::Index j = 0; j < size; ++j) {
    for (Eigen::Index i = 0; i < size; ++i) {
      matrix(i, j) = std::polar(1.0, static_cast<double>((i * i + 3 * i * j) % 997));
    }
    matrix(j, j) += 2.0 * static_cast<double>(size);
  }
  return speed_of([&] { const DenseLu lu(matrix); }, 8.0 / 3.0 * std::pow(static_cast<double>(size), 3));
}

template <int kHalvings>
const Speed& speed_at(double rows) {
  constexpr double kSize = kTimedRows / (1 << kHalvings);
  if constexpr (kHalvings < 3) {
    if (rows <= 0.75 * kSize) {
      return speed_at<kHalvings + 1>(rows);
    }
  }
  static const Speed speed = measure_lu(static_cast<Eigen::Index>(kSize));  // a sweep asks for every case
  return speed;
}

constexpr double kSingleComplex = 8;    // bytes
constexpr double kLuFlops = 8.0 / 3.0;  // complex operations counted as real ones, times n^3
constexpr double kNearPairs = 220;      // a face, of Burton-Miller's near corrections on a uniform mesh
constexpr double kNearBytes = 24;       // a pair, while they are gathered
constexpr double kNearCost = 500;       // of a near pair, in double, over one pair of a product in single precision
constexpr double kMillerCost = 1.3;     // of a product with W over one with D alone

constexpr int kSources = 16;
constexpr std::uint64_t kSeed = 1;
constexpr double kSplitSeconds = 60.0;  // that the split mesh may take
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// Where the target is, or else the face nearest to the array.
Vector3 centre_of_interest(const Model& model) {
  if (!model.boxes.empty()) {
    return model.boxes.front().centre;
  }
  const TriangleMesh& mesh = model.body.mesh;
  Eigen::Index face = 0;
  if (model.fixed->array.kind == TransducerArray::Kind::kPlaneWave) {
    (model.fixed->array.axes.col(0).transpose() * mesh.centroids()).minCoeff(&face);
  } else {
    (mesh.centroids().colwise() - model.fixed->array.positions.rowwise().mean().eval())
        .colwise()
        .norm()
        .minCoeff(&face);
  }
  return mesh.centroids().col(face);
}

/// Areas of the faces within reach of a point, 0 of the others.
Eigen::VectorXd areas_near(const TriangleMesh& mesh, const Vector3& centre, double reach) {
  Eigen::VectorXd areas = mesh.areas();
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if ((mesh.centroids().col(f) - centre).norm() > reach) {
      areas(f) = 0.0;
    }
  }
  return areas;
}

ErrorSummary summarise(const Eigen::VectorXd& areas, const Eigen::MatrixXcd& found, const Eigen::MatrixXcd& exact) {
  if (areas.sum() <= 0) {
    return {kNothing, kNothing};
  }
  Eigen::VectorXd errors(found.cols());
  for (Eigen::Index s = 0; s < found.cols(); ++s) {
    errors(s) = relative_difference(areas, found.col(s), exact.col(s));
  }
  return {errors.maxCoeff(), std::sqrt(errors.squaredNorm() / static_cast<double>(errors.size()))};
}

Eigen::VectorXcd focused_pressure(const Model& model, const TriangleMesh& mesh, Progress& progress) {
  std::vector<SolveRecord> records;
  const SolveSpec& solve = model.fixed->scene.solve;
  SkinScattering scattering(mesh, model.fixed->wave, solve.scheme, solve.solver, model.fixed->array, records, progress);
  return scattering.pressure(free_focus(model), "accuracy");
}

/// The difference to the split mesh, where it is affordable.
void compare_split(const Model& model, AccuracyReport& report, Progress& progress) {
  report.split_body = kNothing;
  report.split_target = kNothing;
  const TriangleMesh& mesh = model.body.mesh;
  const Eigen::Index faces = 4 * mesh.face_count();
  const SolveSpec& solve = model.fixed->scene.solve;
  GridBody body = grid_body(mesh);
  body.faces *= 4.0;
  const BodyCost cost = body_cost(body, model.fixed->wave, solve.solver);
  const SolverDecision decision = choose_solver(solve.solver, solve.scheme, faces, available_memory(), 1, cost);
  const auto [bytes, seconds, note] = scattering_cost(decision, solve.scheme, body.faces, 0.0, 1.0,
                                                      16.0 * product_seconds(mesh, model.fixed->wave), cost);
  if (seconds > kSplitSeconds) {
    report.split_reason = fmt::format("{} faces would take about {:.0f} s", faces, seconds);
    return;
  }
  if (bytes > available_memory()) {
    report.split_reason = fmt::format("{} faces would take {:.1f} GiB", faces, bytes / std::pow(2.0, 30));
    return;
  }
  const TriangleMesh fine = split_faces(mesh);
  const Eigen::VectorXcd coarse_pressure = focused_pressure(model, mesh, progress);
  const Eigen::VectorXcd fine_pressure =
      EvaluationComparison(mesh, fine, 1).at_centroids(focused_pressure(model, fine, progress));
  report.split_body = relative_difference(mesh.areas(), coarse_pressure, fine_pressure);
  if (!model.boxes.empty()) {
    report.split_target =
        relative_difference(areas_near(mesh, centre_of_interest(model), kTargetReach), coarse_pressure, fine_pressure);
  }
}

}  // namespace

double product_seconds(const TriangleMesh& mesh, const Wave& wave) {
  constexpr Eigen::Index kTimedPairs = 30'000'000;
  const Eigen::Index rows = std::min({mesh.face_count(), Eigen::Index{1024}, kTimedPairs / mesh.face_count() + 1});
  const LayerSum<float> sum(mesh, wave.wavenumber(), 0.0);
  const Eigen::MatrixXcd x = Eigen::MatrixXcd::Ones(mesh.face_count(), 1);
  sum.apply_head(Layer::kDouble, x, std::min<Eigen::Index>(rows, 16));  // wakes the threads
  double seconds = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < 3; ++trial) {  // the fastest: others wait for a thread
    seconds = std::min(seconds, seconds_of([&] { sum.apply_head(Layer::kDouble, x, rows); }));
  }
  constexpr double kPairs = 0.55;  // time by pairs over time row by row
  return kPairs * seconds * static_cast<double>(mesh.face_count()) / static_cast<double>(rows);
}

Speed speed_of(const std::function<void()>& work, double operations) {
  constexpr int kTrials = 2;       // the first one also wakes the threads
  constexpr double kGuess = 1e10;  // of a core of about 2015 in double precision
  std::string fault = "it took no time";
  try {
    double fastest = std::numeric_limits<double>::infinity();
    for (int trial = 0; trial < kTrials; ++trial) {
      fastest = std::min(fastest, seconds_of(work));
    }
    const double flops = operations / fastest;
    if (std::isfinite(flops) && flops > 0) {
      return {flops, ""};
    }
  } catch (const std::exception& error) {
    fault = error.what();
  }
  return {kGuess * omp_get_max_threads(),
          fmt::format("this machine's speed could not be measured ({}): times are guesses", fault)};
}

const Speed& measured_speed(double rows) { return speed_at<0>(rows); }

ModelCost scattering_cost(const SolverDecision& decision, Scheme scheme, double faces, double inside, double solves,
                          double product, const BodyCost& body) {
  ModelCost cost;
  const SolverOptions& options = decision.options;
  cost.bytes = solver_memory(static_cast<Eigen::Index>(faces), options, 1);
  const bool miller = traits(scheme).burton_miller;
  if (miller) {
    cost.bytes += kNearBytes * kNearPairs * faces;  // while they are gathered, on a uniform mesh
    cost.seconds += kNearCost * kNearPairs * product / faces;
  }
  if (traits(scheme).interior_points) {
    cost.bytes += 16.0 * faces * inside;
    cost.seconds += 8.0 * faces * faces * inside / measured_speed(faces).flops;
  }
  const double steps = expected_steps(scheme, options.two_level);
  if (options.two_level) {
    const auto unknowns = static_cast<Eigen::Index>(faces);
    cost.bytes += kSingleComplex * body.points * std::min(body.points, double{CoarseInverse::kWholePoints});
    cost.seconds += two_level_seconds(unknowns, body.points) / direct_seconds(unknowns, 1) * product;
  }
  const double in_double = 2.2 * product * (miller ? kMillerCost : 1.0);  // the residual
  if (options.kind == SolverKind::kLu) {
    const double speed = options.precision == Precision::kSingle ? 1.9 : 1.0;
    const Speed& measured = measured_speed(faces);
    cost.seconds += kLuFlops * faces * faces * faces / (speed * measured.flops) + in_double * solves;
    cost.note = measured.note;
  } else if (options.kind == SolverKind::kFft) {
    const double share = product_share(options.kind, static_cast<Eigen::Index>(faces), body.grid.seconds);
    constexpr double kOnce = 3.0;    // to make the grid, in products
    constexpr double kRounds = 3.0;  // of refinement, beyond what grids reach
    cost.bytes += body.grid.memory;
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

Eigen::VectorXcd free_focus(const Model& model) {
  const Eigen::MatrixXcd row = incident_matrix(model.fixed->array, model.fixed->wave, centre_of_interest(model));
  return (Complex(0, -1) * row.transpose().col(0).cwiseArg().cast<Complex>()).array().exp();
}

AccuracyReport interior_indicator(const Model& model, Scheme scheme, const SolverSpec& spec, Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  const TriangleMesh& mesh = model.body.mesh;
  AccuracyReport report;
  report.scheme = to_string(scheme);
  report.sources = kSources;
  report.reach = kTargetReach;
  report.split_body = kNothing;
  report.split_target = kNothing;
  const Points sources = interior_sources(mesh, centre_of_interest(model), kTargetReach, kSources, kSeed);
  std::vector<SolveRecord> unused;
  // The product is chosen for the block of all sources, but of so few columns that no factorisation is.
  constexpr Eigen::Index kFacesASource = 600;
  const Eigen::Index columns = std::min<Eigen::Index>(kSources, mesh.face_count() / kFacesASource + 1);
  SkinScattering scattering(mesh, model.fixed->wave, scheme, spec, model.fixed->array, unused, progress, columns);
  const ScatteringSystem& system = scattering.system();
  const SourceField field = source_field(mesh, model.fixed->wave, sources);
  const IncidentField incident = interior_incident(system, field);
  const SolverOptions& options = scattering.decision().options;
  const Solved solved = make_solver(system, options)->solve(system.right_hand_side(incident));
  report.solver = solver_name(options.kind, solved.report.two_level);
  const Eigen::MatrixXcd found = system.pressure(solved.x, incident);
  report.residual = solved.report.residual;
  report.body = summarise(mesh.areas(), found, field.value);
  report.target = model.boxes.empty()
                      ? ErrorSummary{kNothing, kNothing}
                      : summarise(areas_near(mesh, centre_of_interest(model), kTargetReach), found, field.value);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

AccuracyReport measure_accuracy(const Model& model, Progress& progress) {
  const SolveSpec& solve = model.fixed->scene.solve;
  const auto start = std::chrono::steady_clock::now();
  AccuracyReport report = interior_indicator(model, solve.scheme, solve.solver, progress);
  require_solved({.stage = "accuracy",
                  .scheme = report.scheme,
                  .solver = report.solver,
                  .precision = "",
                  .unknowns = model.body.mesh.face_count(),
                  .residual = report.residual},
                 solve.solver.tolerance);
  compare_split(model, report, progress);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

void add_accuracy(Json& check, const AccuracyReport& report, double edge) {
  // First order in the edge: the split mesh has half the error, so twice the difference is the error.
  const bool split = !std::isnan(report.split_body);
  const double error = split ? 2.0 * report.split_body : report.body.rms;
  const auto edge_for = [&](double wanted) { return edge * wanted / error / kMillimetre; };
  check.update({{"accuracy_indicator", fmt::format("{} sources inside; the target's surroundings: {:.0f} mm",
                                                   report.sources, report.reach / kMillimetre)},
                {"accuracy_l2", report.body.rms},
                {"accuracy_max", report.body.worst},
                {"accuracy_target_l2", report.target.rms},
                {"accuracy_target_max", report.target.worst},
                {"accuracy_split", report.split_body},
                {"accuracy_split_target", report.split_target},
                {"accuracy_split_reason", report.split_reason},
                {"accuracy_seconds", report.seconds},
                {"accuracy_edges_mm",
                 {{"for_5_percent", edge_for(0.05)},
                  {"for_2_percent", edge_for(0.02)},
                  {"for_1_percent", edge_for(0.01)},
                  {"by", split ? "twice the difference to the split mesh" : "the indicator"}}}});
}

}  // namespace touchfield
