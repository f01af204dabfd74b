#include "sim/run/run_data.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstdint>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

/// A stage and a metric may share an attribute (seconds_solve) only if they say the same.
void require_no_conflict(const MethodResult& method) {
  for (const auto& [stage, seconds] : method.seconds) {
    for (const MetricField& field : metric_fields()) {
      const double metric = method.metrics.*field.value;
      if ("seconds_" + stage == field.name &&
          std::bit_cast<std::uint64_t>(metric) != std::bit_cast<std::uint64_t>(seconds)) {
        throw InputError(fmt::format("method {}: stage '{}' took {} s but the metric {} is {}", method.name, stage,
                                     seconds, field.name, metric));
      }
    }
  }
}

void check_response(const std::string& what, const ChannelResponse& response, Eigen::Index channels) {
  if (!response.as_designed() || response.phase.size() != 0) {
    require_size(what + ": gain", response.gain.size(), channels);
    require_size(what + ": phase", response.phase.size(), channels);
  }
}

void check_transfers(const Run& run) {
  const Eigen::Index faces = run.target ? run.target->size() : 0;
  std::set<std::string> schemes;
  for (const RunTransfer& transfer : run.transfers) {
    require_name("transfer", transfer.scheme, schemes);
    const std::string what = "transfer " + transfer.scheme;
    const SkinProblem& problem = transfer.problem;
    require_size(what + ": weights", problem.weights.size(), faces);
    require_size(what + ": amplitudes", problem.amplitudes.size(), faces);
    for (const auto& [name, matrix] : {std::pair{"target", &problem.target}, {"incident", &transfer.incident}}) {
      require_size(fmt::format("{}: a column of {}", what, name), matrix->rows(), faces);
      require_size(fmt::format("{}: a row of {}", what, name), matrix->cols(), run.array.size());
    }
    require_size(what + ": a row of outside", problem.outside.cols(), run.array.size());
  }
}

void check_evaluation(const Run& run) {
  if (run.evaluation != "none" && run.evaluation != "same" && !has_evaluation_model(run.evaluation)) {
    throw InputError(fmt::format("evaluation '{}' must be one of none, same, edge, split", run.evaluation));
  }
  if (has_evaluation_model(run.evaluation) != run.evaluation_model.has_value()) {
    throw InputError(fmt::format("evaluation '{}' must {} a model of its own", run.evaluation,
                                 run.evaluation_model ? "not have" : "have"));
  }
  const TriangleMesh& mesh = evaluated_mesh(run);
  if (run.evaluation_model && run.evaluation_model->target) {
    check_target("evaluation's target", *run.evaluation_model->target, mesh.face_count());
  }
  for (const MethodResult& method : run.methods) {
    if (method.evaluation_pressure.size() != 0) {
      require_size(fmt::format("method {}: evaluation's pressure", method.name), method.evaluation_pressure.size(),
                   run.evaluation == "none" ? 0 : mesh.face_count());
    }
    if (method.radiation.size() != 0) {
      require_size(fmt::format("method {}: radiation", method.name), method.radiation.size(), mesh.face_count());
    }
  }
}

}  // namespace

Eigen::VectorXd wanted_pressure(const Target& target, Eigen::Index faces) {
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(faces);
  wanted(target.faces) = target.shares.cwiseProduct(target.amplitudes);
  return wanted;
}

void require_size(const std::string& what, Eigen::Index size, Eigen::Index wanted) {
  require(size == wanted, "{} has {} values, must have {}", what, size, wanted);
}

void require_name(const std::string& what, const std::string& name, std::set<std::string>& taken) {
  const bool plain = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return c < 0x80 && (std::isalnum(c) != 0 || c == '_' || c == '-');
  });
  require(plain, "{} name '{}' must be made of letters, digits, _ and -", what, name);
  require(taken.insert(name).second, "{} name '{}' is used twice", what, name);
}

void require_stages(const std::string& what, const std::vector<std::pair<std::string, double>>& seconds) {
  std::set<std::string> taken;
  for (const auto& [stage, value] : seconds) {
    if (stage.empty() || !taken.insert(stage).second) {
      throw InputError(fmt::format("{}: stage '{}' must have a name of its own", what, stage));
    }
  }
}

void check_array(const TransducerArray& array) {
  const Eigen::Index channels = array.size();
  require_size("array: axes", array.axes.cols(), channels);
  require_size("array: amplitudes", array.amplitudes.size(), channels);
  require_size("array: device", array.device.size(), channels);
  require_size("array: channel", array.channel.size(), channels);
  check_response("array", array.response, channels);
}

void check_target(const std::string& what, const Target& target, Eigen::Index faces) {
  require_size(what + ": amplitudes", target.amplitudes.size(), target.size());
  require_size(what + ": shares", target.shares.size(), target.size());
  require((target.shares.array() > 0.0).all() && (target.shares.array() <= 1.0).all(),
          "{}: shares must be > 0 and <= 1", what);
  require_size(what + ": box", static_cast<Eigen::Index>(target.box.size()), target.size());
  for (const Eigen::Index face : target.faces) {
    if (face < 0 || face >= faces) {
      throw InputError(fmt::format("{}: face {} must be in 0..{}", what, face, faces - 1));
    }
  }
}

const std::vector<ProvenanceField>& provenance_fields() {
  static const std::vector<ProvenanceField> kFields = {
      {"version", &Provenance::version},
      {"revision", &Provenance::revision},
      {"compiler", &Provenance::compiler},
      {"flags", &Provenance::flags},
      {"machine", &Provenance::machine},
      {"blas_core", &Provenance::blas_core},
      {"instruction_level", &Provenance::instruction_level},
      {"card", &Provenance::card},
      {"seeds", &Provenance::seeds},
      {"command_line", &Provenance::command_line},
      {"start", &Provenance::start},
      {"end", &Provenance::end},
      {"scene_hash", &Provenance::scene_hash},
  };
  return kFields;
}

std::string directivity_name(Directivity::Kind kind) {
  switch (kind) {
    case Directivity::Kind::kOmni:
      return "omni";
    case Directivity::Kind::kPiston:
      return "piston";
    case Directivity::Kind::kT4010a1:
      return "t4010a1";
  }
  throw InputError("array: unknown directivity");
}

void check_field(const FieldResult& field) {
  const std::string what = "field " + field.grid.name;
  if (std::ranges::any_of(field.grid.count, [](int n) { return n < 1; })) {
    throw InputError(fmt::format("{}: its grid has no point", what));
  }
  require_size(what + ": inside", static_cast<Eigen::Index>(field.inside.size()), field.grid.size());
  std::set<std::string> methods;
  for (const auto& [name, pressure] : field.pressure) {
    require_name("method", name, methods);
    require_size(fmt::format("{}: pressure of {}", what, name), pressure.size(), field.grid.size());
  }
}

void check_bodies(const Run& run) {
  std::set<std::string> names;
  for (const std::string& name : run.bodies) {
    require_name("body", name, names);
  }
  require_size("owner", static_cast<Eigen::Index>(run.owner.size()), run.bodies.empty() ? 0 : run.mesh.face_count());
  for (const int owner : run.owner) {
    if (owner < 0 || owner >= static_cast<int>(run.bodies.size())) {
      throw InputError(fmt::format("owner: {} must be one of the {} bodies", owner, run.bodies.size()));
    }
  }
}

void check_run(const Run& run) {
  require_stages("resonance_checks", run.resonance_checks);
  check_array(run.array);
  if (run.array_truth) {
    check_response("array's truth", run.array_truth->response, run.array.size());
    if (run.array_truth->phase_levels < 0) {
      throw InputError(fmt::format("array's truth: phase_levels = {} must be >= 0", run.array_truth->phase_levels));
    }
  }
  if (run.target) {
    check_target("target", *run.target, run.mesh.face_count());
  }
  check_bodies(run);
  check_transfers(run);
  require_stages("run", run.seconds);
  std::set<std::string> methods;
  for (const MethodResult& method : run.methods) {
    require_name("method", method.name, methods);
    const std::string what = "method " + method.name;
    require_size(what + ": phases", method.solution.phases.size(), run.array.size());
    require_size(what + ": amplitudes", method.solution.amplitudes.size(), run.array.size());
    if (method.pressure.size() != 0) {
      require_size(what + ": pressure", method.pressure.size(), run.mesh.face_count());
    }
    require_stages(what, method.seconds);
    require_no_conflict(method);
  }
  check_evaluation(run);
  std::set<std::string> fields;
  for (const FieldResult& field : run.fields) {
    require_name("field", field.grid.name, fields);
    check_field(field);
    for (const auto& [name, pressure] : field.pressure) {
      require(methods.contains(name), "field {}: '{}' must be a method of the run", field.grid.name, name);
    }
  }
}

}  // namespace touchfield
