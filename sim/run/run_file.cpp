#include "sim/run/run_file.h"

#include <cstring>
#include <filesystem>

#include <fmt/format.h>

#include "sim/run/target_archive.h"

namespace touchfield {

namespace {

constexpr ArchiveFormat kRunArchive = {"run", kRunFormatVersion};

// Below, Io is GroupWriter or GroupReader, and what is written or read a const or a plain reference.

template <class Io, class Optional>
void optional_target(const Io& io, Optional& target) {
  io.part("target", target.has_value(), [&](const Io& part) {
    if constexpr (Io::kReads) {
      target.emplace();
    }
    target_parts(part, *target);
  });
}

template <class Io, class Method>
void method_parts(const Io& io, Method& result) {
  io.attribute("method", result.method);
  io.attribute("scheme", result.scheme);
  io.choice("status", result.solution.status, status_choices());
  io.attribute("steps", result.solution.iterations);
  for (const MetricField& field : metric_fields()) {
    io.later_attribute(field.name, result.metrics.*field.value);
  }
  io.later_attribute("shock_distance_share", result.shock_distance_share);
  io.stages("seconds_", result.seconds);
  io.list("phase", result.solution.phases, "rad");
  io.list("amplitude", result.solution.amplitudes, "1");
  io.optional_list("pressure", result.pressure, "Pa");
  io.optional_list("cost", result.solution.cost_history, "Pa2");
}

/// What the evaluation shares with the solving model is a link to the data there.
void evaluation_parts(const GroupWriter& io, const Run& run) {
  io.attribute("evaluation", run.evaluation);
  if (run.evaluation_model) {
    io.attribute("scheme", run.evaluation_model->scheme);
    io.part("mesh", true, [&](const GroupWriter& part) { mesh_parts(part, run.evaluation_model->mesh); });
    optional_target(io, run.evaluation_model->target);
  } else {
    io.link("mesh", "/mesh");
    if (run.target) {
      io.link("target", "/target");
    }
  }
  const hdf5::Group methods = io.create("methods");
  for (const MethodResult& result : run.methods) {
    const bool linked = !run.evaluation_model && result.pressure.size() != 0;
    if (result.evaluation_pressure.size() == 0 && !linked) {
      continue;
    }
    const GroupWriter part(methods.create(result.name));
    if (result.evaluation_pressure.size() != 0) {
      part.list("pressure", result.evaluation_pressure, "Pa");
    } else {
      part.link("pressure", "/methods/" + result.name + "/pressure");
    }
    if (run.evaluation_model) {
      part.optional_list("radiation", result.radiation, "Pa");
    } else if (result.radiation.size() != 0) {
      part.link("radiation", "/methods/" + result.name + "/radiation");
    }
  }
}

bool same_bits(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(Complex) * static_cast<std::size_t>(a.size())) == 0;
}

/// Needs the run's methods.
void evaluation_parts(const GroupReader& io, Run& run) {
  io.attribute("evaluation", run.evaluation);
  if (has_evaluation_model(run.evaluation)) {
    std::string scheme;
    io.attribute("scheme", scheme);
    run.evaluation_model = EvaluationModel{scheme, read_mesh(GroupReader(io.open("mesh"))), std::nullopt};
    optional_target(io, run.evaluation_model->target);
  } else if (run.evaluation != "same") {
    io.fail(fmt::format("unknown evaluation '{}'", run.evaluation));
  }
  const hdf5::Content methods = io.open("methods");
  for (MethodResult& result : run.methods) {
    if (methods.has(result.name)) {
      const GroupReader part(methods.open(result.name));
      part.list("pressure", result.evaluation_pressure, "Pa");
      if (run.evaluation_model) {
        part.optional_list("radiation", result.radiation, "Pa");
      }
      if (!run.evaluation_model && same_bits(result.evaluation_pressure, result.pressure)) {
        result.evaluation_pressure.resize(0);
      }
    }
  }
}

/// Needs the run's array and target. The attributes say how to multiply.
void transfer_parts(const GroupWriter& io, const RunTransfer& /*transfer*/, const Run& /*run*/) {
  io.attribute("pressure",
               std::string("p[face] = target @ q, without scattering incident @ q; q = amplitude * exp(i phase)"));
  io.attribute("cost", std::string("sum(weight * (abs(target @ q) - wanted)**2) + sum(abs(outside @ q)**2)"));
  io.link("face", "/target/face");
  io.link("wanted", "/target/amplitude");
  io.link("share", "/target/share");
}

void transfer_parts(const GroupReader& io, RunTransfer& transfer, const Run& run) {
  if (!run.target) {
    io.fail("the run must have a target");
  }
  transfer.problem.amplitudes = run.target->amplitudes;
  transfer.problem.shares = run.target->shares;
}

template <class Io, class Transfers, class TheRun>
void transfers_parts(const Io& io, Transfers& transfers, TheRun& run) {
  io.parts(
      transfers, [](auto& transfer) -> auto& { return transfer.scheme; },
      [&](const Io& part, auto& transfer) {
        transfer_parts(part, transfer, run);
        part.attribute("outside_weight", transfer.outside_weight);
        part.attribute("channels_left_out", transfer.channels_left_out);
        part.attribute("outside_left_out", transfer.outside_left_out);
        part.list("weight", transfer.problem.weights, "m2");
        part.matrix("target", transfer.problem.target, run.array.size(), "Pa");
        part.matrix("outside", transfer.problem.outside, run.array.size(), "Pa m");
        part.matrix("incident", transfer.incident, run.array.size(), "Pa");
      });
}

template <class Io, class Solves>
void solves_parts(const Io& io, Solves& solves) {
  if constexpr (Io::kReads) {
    std::vector<std::int64_t> unknowns;
    io.list("unknowns", unknowns, "1");
    solves.resize(unknowns.size());
  }
  io.column("stage", solves, &SolveRecord::stage, "text");
  io.column("scheme", solves, &SolveRecord::scheme, "text");
  io.column("solver", solves, &SolveRecord::solver, "text");
  io.column("precision", solves, &SolveRecord::precision, "text");
  io.later_column("device", solves, &SolveRecord::device, "text");
  io.column("unknowns", solves, &SolveRecord::unknowns, "1");
  io.column("right_hand_sides", solves, &SolveRecord::right_hand_sides, "1");
  io.column("steps", solves, &SolveRecord::steps, "1");
  io.column("refinements", solves, &SolveRecord::refinements, "1");
  io.column("residual", solves, &SolveRecord::residual, "1");
  io.column("converged", solves, &SolveRecord::converged, "1");
  io.column("seconds", solves, &SolveRecord::seconds, "s");
}

template <class Io, class Field>
void field_parts(const Io& io, Field& field) {
  auto& grid = field.grid;
  io.three("origin", grid.origin, "m");
  io.three("spacing", grid.spacing, "m");
  io.three("count", grid.count, "1");
  io.on_grid("inside", field.inside, grid, "1");
  io.part("pressure", true, [&](const Io& pressures) {
    if constexpr (Io::kReads) {
      for (const std::string& method : pressures.names()) {
        field.pressure.emplace_back(method, Eigen::VectorXcd());
      }
    }
    for (auto& [method, pressure] : field.pressure) {
      pressures.on_grid(method, pressure, grid, "Pa");
    }
  });
}

/// All but what is said of the run in the root itself, and its mesh.
template <class Io, class TheRun>
void run_parts(const Io& io, TheRun& run) {
  io.part("array", true, [&](const Io& part) {
    array_parts(part, run.array);
    part.part("truth", run.array_truth.has_value(), [&](const Io& truth) {
      if constexpr (Io::kReads) {
        run.array_truth.emplace();
      }
      truth.attribute("phase_levels", run.array_truth->phase_levels);
      response_parts(truth, run.array_truth->response);
    });
  });
  optional_target(io, run.target);
  io.part("methods", !run.methods.empty(), [&](const Io& methods) {
    methods.parts(
        run.methods, [](auto& method) -> auto& { return method.name; },
        [&](const Io& part, auto& method) {
          method_parts(part, method);
          if (!run.evaluation_model) {  // it is of the solving mesh; a file's evaluation is read after
            part.optional_list("radiation", method.radiation, "Pa");
          }
        });
  });
  io.part("evaluation", run.evaluation != "none", [&](const Io& part) { evaluation_parts(part, run); });
  io.part("transfer", !run.transfers.empty(), [&](const Io& part) { transfers_parts(part, run.transfers, run); });
  io.part("solves", !run.solves.empty(), [&](const Io& part) { solves_parts(part, run.solves); });
  io.part("field", !run.fields.empty(), [&](const Io& fields) {
    fields.parts(
        run.fields, [](auto& field) -> auto& { return field.grid.name; },
        [](const Io& part, auto& field) { field_parts(part, field); });
  });
  io.part("seconds", !run.seconds.empty(), [&](const Io& part) { part.stages("", run.seconds); });
  io.part("resonance_checks", !run.resonance_checks.empty(),
          [&](const Io& part) { part.stages("", run.resonance_checks); });
  io.optional_texts("warnings", run.warnings);
  io.optional_texts("notes", run.notes);
  io.part("provenance", true, [&](const Io& part) { provenance_parts(part, run.provenance); });
}

template <class Io, class TheRun>
void bodies_parts(const Io& io, TheRun& run) {
  io.later_attribute("bodies", run.bodies);
  io.optional_list("body", run.owner, "1");
}

void write_run(const GroupWriter& io, const Run& run) {
  format_parts(io, kRunArchive);
  io.attribute("name", run.name);
  io.attribute("complete", run.complete ? 1 : 0);
  io.attribute("resonance_check", run.resonance_check);
  io.attribute("frequency", run.frequency);
  io.attribute("radiation_per_square", run.radiation_per_square);
  io.write_text("scene", run.scene);
  io.part("mesh", true, [&](const GroupWriter& part) {
    mesh_parts(part, run.mesh);
    bodies_parts(part, run);
  });
  run_parts(io, run);
  extent_parts(io, run);
}

Run read_run(const GroupReader& io) {
  require_groups(io);
  const GroupReader mesh(io.open("mesh"));
  Run run{.name = io.text_attribute("name"),
          .scene = io.read_text("scene"),
          .mesh = read_mesh(mesh),
          .complete = io.integer_attribute("complete") != 0};
  io.later_attribute("resonance_check", run.resonance_check);
  io.later_attribute("frequency", run.frequency);
  io.attribute("radiation_per_square", run.radiation_per_square);
  bodies_parts(mesh, run);
  run_parts(io, run);
  extent_parts(io, run);
  return run;
}

}  // namespace

void write_run_file(const std::string& path, const Run& run) {
  check_run(run);
  const hdf5::MemoryFile file(path);
  write_run(GroupWriter(file.root()), run);
  write_archive(path, file);
}

std::string run_file_at(const std::string& path) {
  return std::filesystem::is_directory(path) ? (std::filesystem::path(path) / "run.h5").string() : path;
}

Run read_run_file(const std::string& path, const Warn& warn) {
  Run run = read_run(GroupReader(read_archive(path, kRunArchive, warn)));
  require_undamaged(path, [&] { check_run(run); });
  return run;
}

}  // namespace touchfield
