#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/store/checksum.h"
#include "sim/store/hdf5_content.h"
#include "sim/store/run_file.h"
#include "sim/store/run_layout.h"

namespace touchfield {

namespace {

using hdf5::Content;
using hdf5::Shape;

[[noreturn]] void fail(const Content& group, std::string_view what) {
  throw InputError(fmt::format("{}: {}", group.place(), what));
}

/// Length of a list, or of the first index of a table with `columns` columns.
std::uint64_t length(const Content& group, const std::string& name, std::uint64_t columns = 1) {
  const Shape shape = group.shape(name);
  const bool fits = columns == 1 ? shape.size() == 1 : shape.size() == 2 && shape[1] == columns;
  if (!fits) {
    fail(group, fmt::format("{} must be {}", name, columns == 1 ? "a list" : fmt::format("[n, {}]", columns)));
  }
  return shape[0];
}

Points read_points(const Content& group, const std::string& name, std::uint64_t n) {
  Points points(3, static_cast<Eigen::Index>(n));
  group.read(name, {n, 3}, points.data());
  return points;
}

template <class Vector>
Vector read_vector(const Content& group, const std::string& name, std::uint64_t n) {
  Vector values(static_cast<Eigen::Index>(n));
  group.read(name, {n}, values.data());
  return values;
}

std::vector<std::pair<std::string, double>> read_stages(const Content& group, const std::string& prefix) {
  std::vector<std::pair<std::string, double>> seconds;
  if (group.has_attribute("stages")) {
    for (const std::string& stage : group.texts_attribute("stages")) {
      seconds.emplace_back(stage, group.number_attribute(prefix + stage));
    }
  }
  return seconds;
}

TriangleMesh read_mesh(const Content& group) {
  Points vertices = read_points(group, "vertices", length(group, "vertices", 3));
  const std::uint64_t faces = length(group, "triangles", 3);
  Triangles triangles(3, static_cast<Eigen::Index>(faces));
  group.read("triangles", {faces, 3}, triangles.data());
  try {
    return {std::move(vertices), std::move(triangles)};
  } catch (const InputError& error) {
    fail(group, error.what());
  }
}

Directivity read_directivity(const Content& group) {
  const std::string name = group.text_attribute("directivity");
  if (name == directivity_name(Directivity::Kind::kOmni)) {
    return Directivity::omni();
  }
  if (name == directivity_name(Directivity::Kind::kT4010a1)) {
    return Directivity::t4010a1();
  }
  if (name == directivity_name(Directivity::Kind::kPiston)) {
    const double ka = group.number_attribute("directivity_ka");
    if (ka > 0) {
      return Directivity::piston(ka, 1.0);
    }
    fail(group, fmt::format("directivity_ka = {} must be > 0", ka));
  }
  fail(group, fmt::format("unknown directivity '{}'", name));
}

TransducerArray::Kind read_array_kind(const Content& group) {
  const std::string name = group.text_attribute("kind");
  if (name == "transducers") {
    return TransducerArray::Kind::kTransducers;
  }
  if (name == "plane_wave") {
    return TransducerArray::Kind::kPlaneWave;
  }
  fail(group, fmt::format("unknown kind '{}'", name));
}

TransducerArray read_array(const Content& group) {
  const std::uint64_t n = length(group, "position", 3);
  TransducerArray array;
  array.kind = read_array_kind(group);
  array.directivity = read_directivity(group);
  array.positions = read_points(group, "position", n);
  array.axes = read_points(group, "axis", n);
  array.amplitudes = read_vector<Eigen::VectorXd>(group, "amplitude", n);
  array.device = read_vector<Eigen::VectorXi>(group, "device", n);
  array.channel = read_vector<Eigen::VectorXi>(group, "channel", n);
  return array;
}

Target read_target(const Content& group, const TriangleMesh& mesh) {
  const std::uint64_t n = length(group, "face");
  std::vector<std::int64_t> faces(n);
  group.read("face", {n}, faces.data());
  Target target;
  for (const std::int64_t face : faces) {
    if (face < 0 || face >= mesh.face_count()) {
      fail(group, fmt::format("face {} must be in 0..{}", face, mesh.face_count() - 1));
    }
    target.faces.push_back(face);
  }
  target.amplitudes = read_vector<Eigen::VectorXd>(group, "amplitude", n);
  target.box.resize(n);
  group.read("box", {n}, target.box.data());
  return target;
}

PhaseStatus read_status(const Content& group) {
  const std::string name = group.text_attribute("status");
  for (const PhaseStatus status :
       {PhaseStatus::kConverged, PhaseStatus::kIterationLimit, PhaseStatus::kStalled, PhaseStatus::kDirect}) {
    if (name == to_string(status)) {
      return status;
    }
  }
  fail(group, fmt::format("unknown status '{}'", name));
}

MethodResult read_method(const Content& group, const std::string& name, const Run& run) {
  const auto channels = static_cast<std::uint64_t>(run.array.size());
  MethodResult result;
  result.name = name;
  result.method = group.text_attribute("method");
  result.scheme = group.text_attribute("scheme");
  result.solution.status = read_status(group);
  result.solution.iterations = group.integer_attribute("steps");
  result.solution.phases = read_vector<Eigen::VectorXd>(group, "phase", channels);
  result.solution.amplitudes = read_vector<Eigen::VectorXd>(group, "amplitude", channels);
  if (group.has("pressure")) {
    result.pressure =
        read_vector<Eigen::VectorXcd>(group, "pressure", static_cast<std::uint64_t>(run.mesh.face_count()));
  }
  if (group.has("cost")) {
    const std::uint64_t n = length(group, "cost");
    result.solution.cost_history.resize(n);
    group.read("cost", {n}, result.solution.cost_history.data());
  }
  for (const MetricField& field : metric_fields()) {
    if (group.has_attribute(field.name)) {  // a metric that is newer than the file was not computed
      result.metrics.*field.value = group.number_attribute(field.name);
    }
  }
  result.seconds = read_stages(group, "seconds_");
  return result;
}

FieldResult read_field(const Content& group, const std::string& name) {
  FieldResult field;
  FieldGrid& grid = field.grid;
  grid.name = name;
  group.read("origin", {3}, grid.origin.data());
  group.read("spacing", {3}, grid.spacing.data());
  group.read("count", {3}, grid.count.data());
  if (group.shape("inside") != grid_shape(grid)) {
    fail(group, fmt::format("count {} x {} x {} does not fit the shape of inside", grid.count[0], grid.count[1],
                            grid.count[2]));
  }
  field.inside.resize(static_cast<std::size_t>(grid.size()));
  group.read("inside", grid_shape(grid), field.inside.data());
  const Content pressures = group.open("pressure");
  for (const std::string& method : pressures.names()) {
    const Shape shape = pressures.shape(method);
    if (shape != grid_shape(grid)) {
      fail(pressures, fmt::format("{} does not fit the grid", method));
    }
    Eigen::VectorXcd pressure(grid.size());
    pressures.read(method, shape, pressure.data());
    field.pressure.emplace_back(method, std::move(pressure));
  }
  return field;
}

Eigen::MatrixXcd read_matrix(const Content& group, const std::string& name, std::uint64_t columns) {
  const Shape shape = group.shape(name);
  if (shape.size() != 2 || shape[1] != columns) {
    fail(group, fmt::format("{} must be [n, {}]", name, columns));
  }
  Eigen::MatrixXcd by_rows(static_cast<Eigen::Index>(columns), static_cast<Eigen::Index>(shape[0]));
  group.read(name, shape, by_rows.data());
  return by_rows.transpose();
}

/// Needs the run's array and target.
RunTransfer read_transfer(const Content& group, const std::string& scheme, const Run& run) {
  if (!run.target) {
    fail(group, "the run must have a target");
  }
  const auto channels = static_cast<std::uint64_t>(run.array.size());
  RunTransfer transfer;
  transfer.scheme = scheme;
  transfer.problem = {read_matrix(group, "target", channels), run.target->amplitudes,
                      read_vector<Eigen::VectorXd>(group, "weight", length(group, "weight")),
                      read_matrix(group, "quiet", channels)};
  transfer.incident = read_matrix(group, "incident", channels);
  transfer.quiet_weight = group.number_attribute("quiet_weight");
  transfer.channels_left_out = group.number_attribute("channels_left_out");
  transfer.quiet_left_out = group.number_attribute("quiet_left_out");
  return transfer;
}

bool same_bits(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(Complex) * static_cast<std::size_t>(a.size())) == 0;
}

/// Needs the run's mesh and methods.
void read_judge(const Content& group, Run& run) {
  run.judge = group.text_attribute("judge");
  if (has_judge_model(run.judge)) {
    run.judge_model = JudgeModel{group.text_attribute("scheme"), read_mesh(group.open("mesh")), std::nullopt};
    if (group.has("target")) {
      run.judge_model->target = read_target(group.open("target"), run.judge_model->mesh);
    }
  } else if (run.judge != "same") {
    fail(group, fmt::format("unknown judge '{}'", run.judge));
  }
  const TriangleMesh& mesh = run.judge_model ? run.judge_model->mesh : run.mesh;
  const Content methods = group.open("methods");
  for (MethodResult& result : run.methods) {
    if (!methods.has(result.name)) {
      continue;
    }
    auto pressure = read_vector<Eigen::VectorXcd>(methods.open(result.name), "pressure",
                                                  static_cast<std::uint64_t>(mesh.face_count()));
    const bool solved = !run.judge_model && same_bits(pressure, result.pressure);
    if (!solved) {
      result.judge_pressure = std::move(pressure);
    }
  }
}

std::vector<SolveRecord> read_solves(const Content& group) {
  const std::uint64_t n = length(group, "unknowns");
  std::vector<SolveRecord> solves(n);
  for_each_solve_column([&]<class Value>(const char* name, Value SolveRecord::*member, const char* /*unit*/) {
    if constexpr (std::is_same_v<Value, std::string>) {
      std::vector<std::string> texts = group.read_texts(name);
      if (texts.size() != n) {
        fail(group, fmt::format("{} has {} texts, must have {}", name, texts.size(), n));
      }
      for (std::size_t i = 0; i < n; ++i) {
        solves[i].*member = std::move(texts[i]);
      }
    } else {
      std::vector<StoredNumber<Value>> numbers(n);
      group.read(name, {n}, numbers.data());
      for (std::size_t i = 0; i < n; ++i) {
        solves[i].*member = static_cast<Value>(numbers[i]);
        if (!std::is_same_v<Value, double> && static_cast<StoredNumber<Value>>(solves[i].*member) != numbers[i]) {
          fail(group, fmt::format("{}[{}] = {} is out of range", name, i, numbers[i]));
        }
      }
    }
  });
  return solves;
}

Provenance read_provenance(const Content& group) {
  Provenance provenance;
  for (const ProvenanceField& field : provenance_fields()) {
    if (group.has_attribute(field.name)) {
      provenance.*field.value = group.text_attribute(field.name);
    }
  }
  if (group.has_attribute("threads")) {
    provenance.threads = group.integer_attribute("threads");
  }
  return provenance;
}

void require_format(const Content& root, const std::string& path) {
  if (!root.has_attribute("format") || root.text_attribute("format") != kRunFormat) {
    throw InputError(
        fmt::format("{}: is an HDF5 file but no touchfield run (its attribute format must be {})", path, kRunFormat));
  }
  const int version = root.integer_attribute("format_version");
  if (version > kRunFormatVersion) {
    throw InputError(fmt::format("{}: format version {} is newer than the {} that this program reads", path, version,
                                 kRunFormatVersion));
  }
  if (version < 1) {
    fail(root, fmt::format("format_version = {} must be >= 1", version));
  }
}

void read_bodies(const Content& mesh, Run& run) {
  if (!mesh.has_attribute("bodies")) {
    return;
  }
  run.bodies = mesh.texts_attribute("bodies");
  run.owner.resize(static_cast<std::size_t>(run.mesh.face_count()));
  mesh.read("body", {run.owner.size()}, run.owner.data());
}

Run read_run(const Content& root) {
  for (const char* group : {"mesh", "array"}) {
    if (!root.has(group)) {
      fail(root, fmt::format("holds no group {}", group));
    }
  }
  Run run{.name = root.text_attribute("name"),
          .scene = root.read_text("scene"),
          .mesh = read_mesh(root.open("mesh")),
          .array = read_array(root.open("array")),
          .target = std::nullopt,
          .judge = "none",
          .judge_model = std::nullopt,
          .methods = {},
          .fields = {},
          .solves = {},
          .seconds = {},
          .alarm = root.has_attribute("alarm") ? root.number_attribute("alarm") : kNotComputed,
          .warnings = {},
          .provenance = {},
          .complete = root.integer_attribute("complete") != 0,
          .bodies = {},
          .owner = {},
          .transfers = {}};
  read_bodies(root.open("mesh"), run);
  if (root.has("target")) {
    run.target = read_target(root.open("target"), run.mesh);
  }
  if (root.has("methods")) {
    const Content methods = root.open("methods");
    for (const std::string& name : methods.names()) {
      run.methods.push_back(read_method(methods.open(name), name, run));
    }
  }
  if (root.has("judge")) {
    read_judge(root.open("judge"), run);
  }
  if (root.has("transfer")) {
    const Content transfers = root.open("transfer");
    for (const std::string& scheme : transfers.names()) {
      run.transfers.push_back(read_transfer(transfers.open(scheme), scheme, run));
    }
  }
  if (root.has("solves")) {
    run.solves = read_solves(root.open("solves"));
  }
  if (root.has("field")) {
    const Content fields = root.open("field");
    for (const std::string& name : fields.names()) {
      run.fields.push_back(read_field(fields.open(name), name));
    }
  }
  if (root.has("seconds")) {
    run.seconds = read_stages(root.open("seconds"), "");
  }
  if (root.has("warnings")) {
    run.warnings = root.read_texts("warnings");
  }
  if (root.has("provenance")) {
    run.provenance = read_provenance(root.open("provenance"));
  }
  return run;
}

/// throws   InputError if there is no such file or it does not begin as every HDF5 file does
void require_hdf5(const std::string& path) {
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw InputError(fmt::format("{}: {}", path, error ? error.message() : "is no file"));
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
  }
  std::array<char, kSignature.size()> begin{};
  file.read(begin.data(), begin.size());
  if (std::string_view(begin.data(), static_cast<std::size_t>(file.gcount())) != kSignature) {
    throw InputError(fmt::format("{}: is no HDF5 file", path));
  }
}

/// Most damage is met here, before HDF5 is asked to make sense of it.
void require_checksum(const std::string& path) {
  switch (check_file(path)) {
    case Checksum::kCorrect:
      return;
    case Checksum::kWrong:
      throw InputError(fmt::format("{}: is damaged: its checksum does not fit", path));
    case Checksum::kAbsent:
      throw InputError(
          fmt::format("{}: is no touchfield run, or no longer: the checksum line at its end is missing "
                      "(cut off, or rewritten by another program)",
                      path));
  }
}

}  // namespace

Run read_run_file(const std::string& path) {
  require_hdf5(path);
  require_checksum(path);
  const Content root = hdf5::read_content(path);
  require_format(root, path);
  Run run = read_run(root);
  try {
    check_run(run);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: is damaged: {}", path, error.what()));
  }
  return run;
}

}  // namespace touchfield
