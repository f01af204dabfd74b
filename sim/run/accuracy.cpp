#include "sim/run/accuracy.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/interior_sources.h"
#include "sim/core/units.h"
#include "sim/mesh/query/interior_points.h"
#include "sim/mesh/topology.h"
#include "sim/model/evaluation_comparison.h"
#include "sim/run/cost.h"
#include "sim/run/skin_scattering.h"
#include "sim/run/speed.h"

namespace touchfield {

namespace {

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
  const GridChoice grid = solver_grid(body, model.fixed->wave, solve.solver);
  const SolverDecision decision = choose_solver(solve.solver, solve.scheme, faces, available_memory(), 1, grid.seconds);
  const double product =
      product_share(decision.options.kind, faces, grid.seconds) * 16.0 * product_seconds(mesh, model.fixed->wave);
  const double lu = 8.0 / 3.0 * std::pow(static_cast<double>(faces), 3) / 3e10;  // a slow machine's rate
  const double seconds = decision.options.kind == SolverKind::kLu ? lu : 60.0 * product;
  const double bytes = solver_memory(faces, decision.options, 1) + near_memory(static_cast<double>(faces)) +
                       (decision.options.kind == SolverKind::kFft ? grid.memory : 0.0);
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

double edge_for_error(double edge, double error, double wanted) { return edge * wanted / error; }

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
  const auto solver = make_solver(system, scattering.decision().options);
  const Solved solved = solver->solve(system.right_hand_side(incident));
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
  compare_split(model, report, progress);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

void add_accuracy(Json& check, const AccuracyReport& report, double edge) {
  // First order: the split mesh has half the error, so twice the difference is the error.
  const bool split = !std::isnan(report.split_body);
  const double error = split ? 2.0 * report.split_body : report.body.rms;
  const auto edge_for = [&](double wanted) { return edge_for_error(edge, error, wanted) / kMillimetre; };
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
