#pragma once

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/field/evaluate.h"
#include "sim/field/metrics.h"
#include "sim/field/target.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/model/model.h"
#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// What one method found and how it was evaluated.
struct MethodResult {
  std::string name;    // unique in a run
  std::string method;  // paper, unscattered, focus, fixed
  std::string scheme;  // of the boundary elements
  PhaseSolution solution;
  Eigen::VectorXcd pressure;  // M, on the solving mesh [Pa]
  Eigen::VectorXcd
      evaluation_pressure;    // on the evaluation mesh [Pa]; empty: no evaluation, or `pressure` is the evaluation's
  Eigen::VectorXd radiation;  // radiation pressure on the skin that the metrics are of [Pa]; empty without metrics
  Metrics metrics;
  double shock_distance_share = kNotComputed;  // sigma on the way to the loudest place of the skin (incident_field.h)
  std::vector<std::pair<std::string, double>> seconds;  // stage -> seconds
};

struct FieldResult {
  FieldGrid grid;
  std::vector<unsigned char> inside;                               // 1 inside a body; the pressure there is 0
  std::vector<std::pair<std::string, Eigen::VectorXcd>> pressure;  // method name -> total pressure [Pa]
};

/// Where a run came from.
struct Provenance {
  std::string version;
  std::string revision;
  std::string compiler;
  std::string flags;
  std::string machine;
  std::string blas_core;          // whose kernels OpenBLAS ran: "SkylakeX", "Haswell", ...
  std::string instruction_level;  // of the inner loops: "v2", "v3", ...
  std::string card{};             // graphics card that computed, with driver and toolkit; empty: none
  int threads = 0;
  std::string seeds;  // "name=value" separated by spaces, empty if no seed was used
  std::string command_line;
  std::string start;       // UTC, ISO 8601
  std::string end;         // empty while the run continues
  std::string scene_hash;  // of the resolved scene text
};

/// One solve of B p = b: what was done, how well, and how long it took.
struct SolveRecord {
  std::string stage;  // pressure, evaluation, resonance_check, ...
  std::string scheme;
  std::string solver;     // solver_name(): "LU", "GMRES, FFT, two-level", ...
  std::string precision;  // "single", "single refined" or "double"
  std::string device{};   // "cpu" or "cuda:0"
  long unknowns = 0;
  int right_hand_sides = 0;
  int steps = 0;  // most GMRES steps of a column; 0 of LU
  int refinements = 0;
  double residual = kNotComputed;  // worst |b - B p| / |b|, by a product in double
  bool converged = true;
  double seconds = 0;
};

/// The evaluation's own model, where it is not the solving one.
struct EvaluationModel {
  std::string scheme;
  TriangleMesh mesh;             // in the world's frame
  std::optional<Target> target;  // on this mesh
};

/// What the channels make of the skin by one scheme: what method surface works on.
struct RunTransfer {
  std::string scheme;
  SkinProblem problem;           // rows of H at the target's faces, R of the others; amplitudes are the target's
  Eigen::MatrixXcd incident;     // K x N, the target's rows without scattering [Pa]
  double outside_weight = 0;     // w_Z of R
  double channels_left_out = 0;  // share, by norm, of what all channels do to the body that H leaves out
  double outside_left_out = 0;   // of what they do to the skin outside the target that R leaves out
};

/// The stage of a run in which the best pressure of its target was found.
inline constexpr const char* kScaleStage = "scale";

/// Everything a run computed; grows as the run continues.
struct Run {
  std::string name;
  std::string scene;                           // resolved YAML text
  TriangleMesh mesh;                           // in the world's frame; of several bodies one behind the other
  TransducerArray array{};                     // as the solver assumes it
  std::optional<ArrayTruth> array_truth{};     // then evaluation and fields are of it
  double frequency = kNotComputed;             // [Hz]; not known of files from before 0.3
  double radiation_per_square = kNotComputed;  // of its air (metrics.h) [1/Pa]
  std::optional<Target> target{};
  std::string evaluation = "none";                    // none, same (the solving mesh), truth, edge, split
  std::optional<EvaluationModel> evaluation_model{};  // there if evaluation is truth, edge or split
  SkinExtent solved_skin = SkinExtent::kWhole;        // which `mesh` is of
  std::vector<MethodResult> methods{};
  std::vector<FieldResult> fields{};
  std::vector<SolveRecord> solves{};                      // in the order of the run
  std::vector<std::pair<std::string, double>> seconds{};  // stage of the whole run -> seconds
  double resonance_check = kNotComputed;  // |plain - Burton-Miller| / |Burton-Miller|, first method's scheme
  std::vector<std::pair<std::string, double>>
      resonance_checks{};               // the same of each scheme without a cure: scheme -> resonance check
  std::vector<std::string> warnings{};  // what makes it less than trustworthy, "name: what"
  std::vector<std::string> notes{};     // what is worth knowing besides, likewise
  Provenance provenance{};
  bool complete = false;
  std::vector<std::string> bodies{};     // names of the bodies; empty if there is one without a name
  std::vector<int> owner{};              // M: number of the body a face is of; empty with `bodies`
  std::vector<RunTransfer> transfers{};  // one a scheme, where the scene asks for them
};

// What writers and readers of run.h5 and motion.h5 share. docs/run-file.md and docs/motion-file.md are the
// descriptions for people.

/// A text of a run's provenance and the attribute of /provenance that holds it.
struct ProvenanceField {
  const char* name;
  std::string Provenance::*value;
};

const std::vector<ProvenanceField>& provenance_fields();

inline bool has_evaluation_model(const std::string& evaluation) {
  return evaluation == "truth" || evaluation == "edge" || evaluation == "split";
}

/// omni, piston or t4010a1.
std::string directivity_name(Directivity::Kind kind);

/// The skin that the metrics and fields of a run are of: the evaluation's, or the solver's.
inline const TriangleMesh& evaluated_mesh(const Run& run) {
  return run.evaluation_model ? run.evaluation_model->mesh : run.mesh;
}

/// The mean of the wanted |p| over each face of a mesh, 0 off the target, M [Pa].
Eigen::VectorXd wanted_pressure(const Target& target, Eigen::Index faces);

/// throws   InputError if a list that messages call `what` has another size than it must have
void require_size(const std::string& what, Eigen::Index size, Eigen::Index wanted);

/// Names become links in a file and parts of file names.
/// taken    names before it, among which it then is
/// throws   InputError unless it is new and made of letters, digits, _ and -
void require_name(const std::string& what, const std::string& name, std::set<std::string>& taken);

/// throws   InputError if a stage has no name of its own
void require_stages(const std::string& what, const std::vector<std::pair<std::string, double>>& seconds);

/// throws   InputError if a target, which messages call `what`, does not fit itself or a mesh of `faces` faces
void check_target(const std::string& what, const Target& target, Eigen::Index faces);

/// throws   InputError if the parts of an array do not fit each other
void check_array(const TransducerArray& array);

/// throws   InputError naming the first part of the run whose size does not fit the rest, and any name of a method,
///          field or stage that cannot be stored
void check_run(const Run& run);

/// The same for one field by itself.
void check_field(const FieldResult& field);

}  // namespace touchfield
