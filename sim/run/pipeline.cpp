#include "sim/run/pipeline.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/version.h"
#include "sim/field/evaluate.h"
#include "sim/field/judge.h"
#include "sim/output/figures.h"
#include "sim/output/run_file.h"
#include "sim/output/vtk_files.h"
#include "sim/run/methods.h"
#include "sim/run/stages.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

constexpr double kLargestResidual = 1e-8;  // an LU in double stays near 1e-13 unless B is nearly singular
constexpr double kSmallestReciprocalCondition = 1e-8;

/// FNV-1a, 64 bit: tells scenes apart, guards against nothing.
std::string text_hash(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  }
  return fmt::format("fnv1a64:{:016x}", hash);
}

std::string used_seeds(const Scene& scene) {
  std::string seeds;
  for (const MethodSpec& method : scene.solve.methods) {
    if (method.start.kind == StartSpec::Kind::kRandom) {
      seeds += fmt::format("{}{}={}", seeds.empty() ? "" : " ", method.name, method.start.seed);
    }
  }
  return seeds;
}

/// The scheme whose matrix a method works on; the free field knows none.
std::string scheme_of(const MethodSpec& method) {
  const bool uses_matrix = method.kind == MethodKind::kPaper || method.kind == MethodKind::kFocus;
  return uses_matrix ? to_string(method.scheme) : "none";
}

Run begin_run(const Scene& scene, const Model& model, const RunOptions& options) {
  const BuildInfo build = build_info();
  const std::string text = resolved_yaml(scene);
  Provenance provenance{build.version,   build.revision,    build.compiler,       build.flags, machine_description(),
                        options.threads, used_seeds(scene), options.command_line, utc_now(),   "",
                        text_hash(text)};
  Run run{scene.name, text, model.body.mesh,       model.array, std::nullopt, scene.judge == Judge::kSame, {}, {},
          {},         {},   std::move(provenance), false};
  if (scene.target) {
    run.target = build_target(scene, model);
  }
  return run;
}

void write_tables(const Scene& scene, const Run& run, const RunDirectory& directory) {
  if (scene.write.h5) {
    write_run_file(directory.file("run.h5"), run);
  }
  write_metrics_csv(directory.file("metrics.csv"), run);
}

std::unique_ptr<ScatteringSolver> factorise(const ScatteringSystem& system, Run& run, Progress& progress) {
  const double gibibytes = 16.0 * std::pow(static_cast<double>(system.size()), 2) / std::pow(2.0, 30);
  auto solver = timed(progress, run.seconds, "factorise",
                      fmt::format("assemble and factorise B, scheme {}: {} unknowns, {:.2f} GiB, LU in double",
                                  to_string(system.scheme()), system.size(), gibibytes),
                      [&] { return factorise_dense(system); });
  const double reciprocal = timed(progress, run.seconds, "condition", "estimate the condition number of B",
                                  [&] { return solver->reciprocal_condition(); });
  if (reciprocal < kSmallestReciprocalCondition) {
    run.warnings.push_back(
        fmt::format("ill-conditioned: B has a condition number of about {:.1e}; the pressure may keep "
                    "fewer than eight digits of its own system",
                    1.0 / reciprocal));
    progress.warn(run.warnings.back());
  }
  return solver;
}

/// What the solver returned is held against B computed anew.
void verify(const ScatteringSystem& system, const Eigen::MatrixXcd& incident, Run& run, Progress& progress) {
  Eigen::MatrixXcd p(system.size(), static_cast<Eigen::Index>(run.methods.size()));
  Eigen::MatrixXcd b(p.rows(), p.cols());
  for (std::size_t s = 0; s < run.methods.size(); ++s) {
    p.col(static_cast<Eigen::Index>(s)) = run.methods[s].pressure;
    b.col(static_cast<Eigen::Index>(s)) = incident * drive(run.methods[s].solution);
  }
  const double residual = timed(progress, run.seconds, "verify", "verify B p = G q on entries computed anew",
                                [&] { return relative_residual(system, p, b); });
  if (!(residual <= kLargestResidual)) {
    throw NumericalError(
        fmt::format("the solution of B p = G q has a relative residual of {:.1e}, it must be <= {:.0e}", residual,
                    kLargestResidual));
  }
}

MethodResult solve_method(const MethodSpec& method, MethodSolver& solver, const Model& model, const Run& run,
                          Progress& progress) {
  const Eigen::VectorXd amplitudes = run.target ? run.target->amplitudes : Eigen::VectorXd();
  MethodResult result;
  result.name = method.name;
  result.method = to_string(method.kind);
  result.scheme = scheme_of(method);
  result.solution = timed(progress, result.seconds, "solve", fmt::format("solve {}", method.name),
                          [&] { return solver.solve(method, amplitudes, progress); });
  result.pressure = timed(progress, result.seconds, "pressure", fmt::format("scattered pressure of {}", method.name),
                          [&] { return solver.scattered_pressure(result.solution); });
  if (!result.pressure.allFinite()) {
    throw NumericalError(fmt::format("method {}: the scattered pressure is not finite", method.name));
  }
  const auto evaluate = [&] {
    return run.target ? judge(run.mesh, model.wave, model.boxes, *run.target, result.pressure)
                      : judge_without_target(run.mesh, model.wave, result.pressure);
  };
  result.metrics = timed(progress, result.seconds, "judge", fmt::format("judge {}", method.name), evaluate);
  if (!result.solution.cost_history.empty()) {
    result.metrics.cost = result.solution.cost_history.back();
  }
  result.metrics.iterations = result.solution.iterations;
  result.metrics.seconds_solve = result.seconds.front().second;
  result.metrics.seconds_total = 0.0;
  for (const auto& [stage, seconds] : result.seconds) {
    result.metrics.seconds_total += seconds;
  }
  return result;
}

FieldResult evaluate_grid(const FieldGrid& grid, const Model& model, const Run& run) {
  const auto count = static_cast<Eigen::Index>(run.methods.size());
  Eigen::MatrixXcd surface(run.mesh.face_count(), count);
  Eigen::MatrixXcd drives(run.array.size(), count);
  for (Eigen::Index s = 0; s < count; ++s) {
    surface.col(s) = run.methods[static_cast<std::size_t>(s)].pressure;
    drives.col(s) = drive(run.methods[static_cast<std::size_t>(s)].solution);
  }
  FieldValues values = evaluate_field(run.mesh, run.array, model.wave, grid.points(), surface, drives);
  FieldResult field{grid, std::move(values.inside), {}};
  for (Eigen::Index s = 0; s < count; ++s) {
    field.pressure.emplace_back(run.methods[static_cast<std::size_t>(s)].name, values.pressure.col(s));
  }
  return field;
}

void write_vtk(const Scene& scene, const Run& run, const RunDirectory& directory) {
  if (scene.write.vtp) {
    write_surface_vtp(directory.file("surface.vtp"), run);
    write_array_vtp(directory.file("array.vtp"), run);
  }
  if (scene.write.vti) {
    for (const FieldResult& field : run.fields) {
      write_field_vti(directory.file(field.grid.name + ".vti"), field);
    }
  }
}

void draw(const Run& run, const RunDirectory& directory, Progress& progress) {
  if (!can_draw()) {
    progress.warn("no display answers, so no pictures are drawn; scripts/run or xvfb-run -a gives the program one");
    return;
  }
  std::vector<std::pair<std::string, double>> unused;
  timed(progress, unused, "pictures", "draw pictures", [&] { draw_figures(directory.path(), run); });
}

}  // namespace

Run run_scene(const Scene& scene, const Model& model, const RunOptions& options, RunDirectory& directory,
              Progress& progress) {
  Run run = begin_run(scene, model, options);
  std::vector<std::string> names;
  for (const MethodSpec& method : scene.solve.methods) {
    names.push_back(method.name);
  }
  directory.plan(names);

  const ScatteringSystem system(model.body.mesh, model.wave, scene.solve.scheme);
  const auto solver = factorise(system, run, progress);
  MethodSolver methods =
      timed(progress, run.seconds, "incident",
            fmt::format("incident pressure of {} channels on {} faces", model.array.size(), system.size()),
            [&] { return MethodSolver(system, *solver, model.array, run.target); });
  if (scene.target && !scene.target->pressure) {
    const MethodSpec& first = scene.solve.methods.front();
    const auto find_scale = [&] { return methods.best_scale(first, model.wave, model.boxes, progress); };
    run.target->amplitudes *= timed(progress, run.seconds, "scale",
                                    fmt::format("find the target's best pressure for {}", first.name), find_scale);
  }
  for (const MethodSpec& method : scene.solve.methods) {
    run.methods.push_back(solve_method(method, methods, model, run, progress));
    write_tables(scene, run, directory);
    directory.finished(method.name);
  }
  verify(system, methods.incident(), run, progress);
  for (const FieldGrid& grid : model.fields) {
    run.fields.push_back(timed(progress, run.seconds, "field_" + grid.name,
                               fmt::format("field {}: {} points", grid.name, grid.size()),
                               [&] { return evaluate_grid(grid, model, run); }));
  }
  run.complete = true;
  run.provenance.end = utc_now();
  timed(progress, run.seconds, "write", "write results", [&] {
    write_vtk(scene, run, directory);
    write_tables(scene, run, directory);
  });
  if (scene.write.png) {
    draw(run, directory, progress);
  }
  return run;
}

}  // namespace touchfield
