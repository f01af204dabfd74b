#include <algorithm>
#include <iterator>

#include "sim/core/atomic_file.h"
#include "sim/store/checksum.h"
#include "sim/store/run_file.h"
#include "sim/store/run_layout.h"

namespace touchfield {

namespace {

using hdf5::Group;

std::uint64_t count(Eigen::Index n) { return static_cast<std::uint64_t>(n); }

void write_points(const Group& group, const std::string& name, const Points& points, const std::string& unit) {
  group.write(name, points.data(), {count(points.cols()), 3}, unit);
}

void write_vector(const Group& group, const std::string& name, const Eigen::VectorXd& values, const std::string& unit) {
  group.write(name, values.data(), {count(values.size())}, unit);
}

void write_stages(const Group& group, const std::string& prefix,
                  const std::vector<std::pair<std::string, double>>& seconds) {
  if (seconds.empty()) {
    return;
  }
  std::vector<std::string> stages;
  for (const auto& [stage, value] : seconds) {
    stages.push_back(stage);
    if (!group.has_attribute(prefix + stage)) {  // a metric of that name says the same: check_run
      group.set_attribute(prefix + stage, value);
    }
  }
  group.set_attribute("stages", stages);
}

void write_mesh(const Group& group, const TriangleMesh& mesh) {
  write_points(group, "vertices", mesh.vertices(), "m");
  group.write("triangles", mesh.triangles().data(), {count(mesh.face_count()), 3}, "1");
  write_vector(group, "area", mesh.areas(), "m2");
}

void write_array(const Group& group, const TransducerArray& array) {
  const bool plane_wave = array.kind == TransducerArray::Kind::kPlaneWave;
  group.set_attribute("kind", plane_wave ? "plane_wave" : "transducers");
  group.set_attribute("directivity", directivity_name(array.directivity.kind()));
  if (array.directivity.kind() == Directivity::Kind::kPiston) {
    group.set_attribute("directivity_ka", piston_ka(array.directivity));
  }
  write_points(group, "position", array.positions, "m");
  write_points(group, "axis", array.axes, "1");
  write_vector(group, "amplitude", array.amplitudes, plane_wave ? "Pa" : "Pa m");
  group.write("device", array.device.data(), {count(array.size())}, "1");
  group.write("channel", array.channel.data(), {count(array.size())}, "1");
}

void write_target(const Group& group, const Target& target) {
  const std::vector<std::int64_t> faces(target.faces.begin(), target.faces.end());
  group.write("face", faces.data(), {faces.size()}, "1");
  write_vector(group, "amplitude", target.amplitudes, "Pa");
  group.write("box", target.box.data(), {target.box.size()}, "1");
}

void write_method(const Group& group, const MethodResult& result) {
  group.set_attribute("method", result.method);
  group.set_attribute("scheme", result.scheme);
  group.set_attribute("status", to_string(result.solution.status));
  group.set_attribute("steps", result.solution.iterations);
  for (const MetricField& field : metric_fields()) {
    group.set_attribute(field.name, result.metrics.*field.value);
  }
  write_stages(group, "seconds_", result.seconds);
  write_vector(group, "phase", result.solution.phases, "rad");
  write_vector(group, "amplitude", result.solution.amplitudes, "1");
  if (result.pressure.size() != 0) {
    group.write("pressure", result.pressure.data(), {count(result.pressure.size())}, "Pa");
  }
  if (!result.solution.cost_history.empty()) {
    group.write("cost", result.solution.cost_history.data(), {result.solution.cost_history.size()}, "Pa2");
  }
}

/// What the judge shares with the solving model is a link to the data there.
void write_judge(const Group& root, const Run& run) {
  const Group judge = root.create("judge");
  judge.set_attribute("judge", run.judge);
  if (run.judge_model) {
    judge.set_attribute("scheme", run.judge_model->scheme);
    write_mesh(judge.create("mesh"), run.judge_model->mesh);
    if (run.judge_model->target) {
      write_target(judge.create("target"), *run.judge_model->target);
    }
  } else {
    judge.link("mesh", "/mesh");
    if (run.target) {
      judge.link("target", "/target");
    }
  }
  const Group methods = judge.create("methods");
  for (const MethodResult& result : run.methods) {
    const Eigen::VectorXcd& own = result.judge_pressure;
    if (own.size() != 0) {
      methods.create(result.name).write("pressure", own.data(), {count(own.size())}, "Pa");
    } else if (!run.judge_model && result.pressure.size() != 0) {
      methods.create(result.name).link("pressure", "/methods/" + result.name + "/pressure");
    }
  }
}

/// A matrix as [rows, columns].
void write_matrix(const Group& group, const std::string& name, const Eigen::MatrixXcd& matrix,
                  const std::string& unit) {
  const Eigen::MatrixXcd by_rows = matrix.transpose();
  group.write(name, by_rows.data(), {count(matrix.rows()), count(matrix.cols())}, unit);
}

/// The attributes say how to multiply.
void write_transfer(const Group& group, const RunTransfer& transfer) {
  group.set_attribute("pressure",
                      "p[face] = target @ q, without scattering incident @ q; q = amplitude * exp(i phase)");
  group.set_attribute("cost", "sum(weight * (abs(target @ q) - wanted)**2) + sum(abs(quiet @ q)**2)");
  group.set_attribute("quiet_weight", transfer.quiet_weight);
  group.set_attribute("channels_left_out", transfer.channels_left_out);
  group.set_attribute("quiet_left_out", transfer.quiet_left_out);
  group.link("face", "/target/face");
  group.link("wanted", "/target/amplitude");
  write_vector(group, "weight", transfer.problem.weights, "m2");
  write_matrix(group, "target", transfer.problem.target, "Pa");
  write_matrix(group, "quiet", transfer.problem.quiet, "Pa m");
  write_matrix(group, "incident", transfer.incident, "Pa");
}

void write_solves(const Group& group, const std::vector<SolveRecord>& solves) {
  for_each_solve_column([&]<class Value>(const char* name, Value SolveRecord::*member, const char* unit) {
    if constexpr (std::is_same_v<Value, std::string>) {
      std::vector<std::string> texts;
      std::ranges::transform(solves, std::back_inserter(texts), member);
      group.write_texts(name, texts);
    } else {
      std::vector<StoredNumber<Value>> numbers;
      std::ranges::transform(solves, std::back_inserter(numbers), member);
      group.write(name, numbers.data(), {numbers.size()}, unit);
    }
  });
}

void write_field(const Group& group, const FieldResult& field) {
  const FieldGrid& grid = field.grid;
  group.write("origin", grid.origin.data(), {3}, "m");
  group.write("spacing", grid.spacing.data(), {3}, "m");
  group.write("count", grid.count.data(), {3}, "1");
  group.write("inside", field.inside.data(), grid_shape(grid), "1");
  const Group pressures = group.create("pressure");
  for (const auto& [name, pressure] : field.pressure) {
    pressures.write(name, pressure.data(), grid_shape(grid), "Pa");
  }
}

void write_provenance(const Group& group, const Provenance& provenance) {
  for (const ProvenanceField& field : provenance_fields()) {
    group.set_attribute(field.name, provenance.*field.value);
  }
  group.set_attribute("threads", provenance.threads);
}

void write_run(const Group& root, const Run& run) {
  root.set_attribute("format", kRunFormat);
  root.set_attribute("format_version", kRunFormatVersion);
  root.set_attribute("name", run.name);
  root.set_attribute("complete", run.complete ? 1 : 0);
  root.set_attribute("alarm", run.alarm);
  root.write_text("scene", run.scene);
  const Group mesh = root.create("mesh");
  write_mesh(mesh, run.mesh);
  if (!run.bodies.empty()) {
    mesh.set_attribute("bodies", run.bodies);
    mesh.write("body", run.owner.data(), {run.owner.size()}, "1");
  }
  write_array(root.create("array"), run.array);
  if (run.target) {
    write_target(root.create("target"), *run.target);
  }
  if (!run.methods.empty()) {
    const Group methods = root.create("methods");
    for (const MethodResult& result : run.methods) {
      write_method(methods.create(result.name), result);
    }
  }
  if (run.judge != "none") {
    write_judge(root, run);
  }
  if (!run.transfers.empty()) {
    const Group transfers = root.create("transfer");
    for (const RunTransfer& transfer : run.transfers) {
      write_transfer(transfers.create(transfer.scheme), transfer);
    }
  }
  if (!run.solves.empty()) {
    write_solves(root.create("solves"), run.solves);
  }
  if (!run.fields.empty()) {
    const Group fields = root.create("field");
    for (const FieldResult& field : run.fields) {
      write_field(fields.create(field.grid.name), field);
    }
  }
  if (!run.seconds.empty()) {
    write_stages(root.create("seconds"), "", run.seconds);
  }
  if (!run.warnings.empty()) {
    root.write_texts("warnings", run.warnings);
  }
  write_provenance(root.create("provenance"), run.provenance);
}

}  // namespace

void write_run_file(const std::string& path, const Run& run) {
  check_run(run);
  const hdf5::MemoryFile file(path);
  write_run(file.root(), run);
  const std::string bytes = file.bytes();
  write_atomically(path, {bytes, checksum_line(bytes)});
}

}  // namespace touchfield
