#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "sim/core/rigid_motion.h"
#include "sim/run/run_data.h"
#include "tests/support/files.h"

/// What the tests of the output layer share: small runs.
namespace touchfield {
inline namespace support {

/// Inside a TEST the name Run is GoogleTest's own.
using RunData = Run;

/// A flat sheet in z = 0.2 m of columns x rows squares of the given side, two faces a square, normals towards -z.
inline TriangleMesh sheet(int columns, int rows, double side) {
  Points vertices(3, (columns + 1) * (rows + 1));
  Triangles triangles(3, 2 * columns * rows);
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) {
      vertices.col(y * (columns + 1) + x) << side * (x - 0.5 * columns), side * (y - 0.5 * rows), 0.2;
    }
  }
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const int corner = y * (columns + 1) + x;
      const int face = 2 * (y * columns + x);
      triangles.col(face) << corner, corner + columns + 1, corner + 1;
      triangles.col(face + 1) << corner + 1, corner + columns + 1, corner + columns + 2;
    }
  }
  return {vertices, triangles};
}

/// A value that differs at every place and has no short decimal form.
inline Complex made_up(Eigen::Index i, double seed) {
  const double x = static_cast<double>(i) + seed;
  return {1000.0 * std::sin(1.7 * x), 900.0 * std::cos(2.3 * x)};
}

inline Eigen::VectorXcd made_up_pressure(Eigen::Index n, double seed) {
  Eigen::VectorXcd p(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    p(i) = made_up(i, seed);
  }
  return p;
}

inline MethodResult made_up_method(const std::string& name, const Run& run, double seed) {
  MethodResult result;
  result.name = name;
  result.method = "paper";
  result.scheme = "chief";
  result.solution.phases = made_up_pressure(run.array.size(), seed).cwiseAbs() / 400.0;
  result.solution.amplitudes = made_up_pressure(run.array.size(), seed + 1).cwiseAbs() / 2000.0;
  result.solution.cost_history = {3.0 + seed, 2.0, 1.0 / 3.0};
  result.solution.iterations = 3;
  result.solution.status = PhaseStatus::kStalled;
  result.pressure = made_up_pressure(run.mesh.face_count(), seed);
  result.metrics.relative_error = 0.1 + seed;
  result.metrics.width_mm = 5.25;
  result.metrics.seconds_solve = 0.75;
  result.seconds = {{"solve", 0.75}, {"apply", 1.0 / 3.0}};
  return result;
}

inline Eigen::MatrixXcd made_up_matrix(Eigen::Index rows, Eigen::Index columns, double seed) {
  return made_up_pressure(rows * columns, seed).reshaped(rows, columns);
}

/// From `first` to 1, phases from -1 to 1.
inline ChannelResponse made_up_response(Eigen::Index channels, double first) {
  return {Eigen::VectorXd::LinSpaced(channels, first, 1.0), Eigen::VectorXd::LinSpaced(channels, -1.0, 1.0)};
}

/// A mesh and an array and nothing else: what every run has.
inline Run bare_run(const TriangleMesh& mesh) {
  return {.name = "bare",
          .scene = "name: bare\n",
          .mesh = mesh,
          .array = make_array(grid_layout(3, 2, 0.01), Directivity::t4010a1(), 0.5, 4.0)};
}

/// A run with something in every place: a target, an evaluation with its own mesh, two methods, a plane and a cube.
inline Run full_run() {
  Run run = bare_run(sheet(6, 4, 0.01));
  run.name = "width \xc3\xbc 5mm";
  run.scene = "name: width\nfrequency_khz: 40\n# \xc3\xa9\n";
  run.target = Target{.faces = {3, 4, 10},
                      .amplitudes = Eigen::Vector3d(1000, 2000, 1e-3),
                      .box = {0, 0, 1},
                      .shares = Eigen::Vector3d(1, 0.25, 0.5)};
  run.target->boxes = {
      {Vector3(0, 0, 0.2), Vector3(0.01, 0.02, 0.03)},
      {Vector3(0.01, 0, 0.2), Vector3(0.01, 0.01, 0.01), extrinsic_rotation(Vector3(0, 0.3, 0.1)),
       TargetShape::kCylinder, 0.25},
      {Vector3(0, 0.01, 0.2), Vector3(0.02, 0.01, 0.01), Eigen::Matrix3d::Identity(), TargetShape::kMask}};
  run.evaluation = "edge";
  run.evaluation_model = EvaluationModel{.scheme = "burton_miller_polished",
                                         .mesh = sheet(8, 5, 0.0075),
                                         .target = Target{.faces = {5, 6, 17, 18},
                                                          .amplitudes = Eigen::Vector4d(1e-3, 7, 1000, 2000),
                                                          .box = {0, 0, 0, 1},
                                                          .shares = Eigen::Vector4d(1, 0.75, 1, 0.5)}};
  run.methods.push_back(made_up_method("surface", run, 0.25));
  run.methods.push_back(made_up_method("paper-2", run, 7.5));  // not in alphabetical order: the run's order must stay
  run.methods[1].pressure(2) = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  run.methods[1].solution.cost_history.clear();
  run.methods[1].solution.status = PhaseStatus::kDirect;
  run.methods[0].evaluation_pressure = made_up_pressure(run.evaluation_model->mesh.face_count(), 3.5);
  run.methods[1].evaluation_pressure = made_up_pressure(run.evaluation_model->mesh.face_count(), 4.5);
  run.methods[0].radiation = run.methods[0].evaluation_pressure.real();
  run.methods[1].evaluation_pressure(7) = std::numeric_limits<double>::quiet_NaN();
  run.solves = {{.stage = "pressure",
                 .scheme = "burton_miller_polished",
                 .solver = "GMRES, matrix-free",
                 .precision = "single refined",
                 .unknowns = 10'842,
                 .right_hand_sides = 3,
                 .steps = 14,
                 .refinements = 2,
                 .residual = 3.1e-6,
                 .converged = true,
                 .seconds = 1.25},
                {.stage = "evaluation",
                 .scheme = "chief",
                 .solver = "LU",
                 .precision = "double",
                 .unknowns = 80,
                 .right_hand_sides = 1,
                 .steps = 0,
                 .refinements = 0,
                 .residual = kNotComputed,
                 .converged = false,
                 .seconds = 1.0 / 3.0}};
  const Eigen::Index channels = run.array.size();
  run.transfers = {{.scheme = "burton_miller",
                    .problem = {.target = made_up_matrix(3, channels, 0.5),
                                .amplitudes = run.target->amplitudes,
                                .weights = run.target->areas(run.mesh.areas()),
                                .outside = made_up_matrix(2, channels, 1.5)},
                    .incident = made_up_matrix(3, channels, 2.5),
                    .outside_weight = 0.25,
                    .channels_left_out = 1e-5 / 3,
                    .outside_left_out = 1e-6 / 7}};
  run.resonance_check = 0.0125;
  run.frequency = 40e3;
  run.radiation_per_square = 1.75e-6;
  for (const auto& [name, count] : {std::pair{"side", std::array{5, 1, 4}}, std::pair{"cube", std::array{3, 4, 2}}}) {
    FieldResult field;
    field.grid = {name, Vector3(-0.01, 0.02, 0.19), Vector3(1e-3, 2e-3, 3e-3), count};
    for (Eigen::Index i = 0; i < field.grid.size(); ++i) {
      field.inside.push_back(i % 3 == 0 ? 1 : 0);
    }
    field.pressure.emplace_back("surface", made_up_pressure(field.grid.size(), 11));
    field.pressure.emplace_back("paper-2", made_up_pressure(field.grid.size(), 12));
    run.fields.push_back(field);
  }
  run.seconds = {{"mesh", 0.125}, {"assemble", 1.0 / 7.0}};
  run.resonance_checks = {{"paper_corrected", 0.5}, {"paper", 1.0 / 3.0}};
  run.methods[0].shock_distance_share = 2.0 / 3.0;
  run.warnings = {"coarse mesh", "two, with \"quotes\""};
  run.notes = {"beyond: at 50 mm"};
  run.solved_skin = SkinExtent::kPart;
  run.provenance = {.version = "0.1.0",
                    .revision = "0123456789ab",
                    .compiler = "GNU 12.2.0",
                    .flags = "-O3",
                    .machine = "host, processor, 2 logical cores",
                    .blas_core = "Haswell",
                    .instruction_level = "v3",
                    .card = "a card (cuda:0), driver for CUDA 13.0, CUDA 12.4",
                    .threads = 2,
                    .seeds = "",
                    .command_line = "touchfield run scene.yaml",
                    .start = "2026-01-01T00:00:00Z",
                    .end = "2026-01-01T00:00:09Z",
                    .scene_hash = "abc"};
  run.complete = true;
  return run;
}

/// The same evaluated by the solving model, its second method by another scheme than its own.
inline Run self_evaluated_run() {
  Run run = full_run();
  run.evaluation = "same";
  run.evaluation_model.reset();
  run.methods[0].evaluation_pressure.resize(0);
  run.methods[0].radiation = run.methods[0].pressure.real();
  run.methods[1].evaluation_pressure = made_up_pressure(run.mesh.face_count(), 4.5);
  return run;
}

}  // namespace support
}  // namespace touchfield
