#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sim/run/run_data.h"

/// What writers and readers of run.h5 and motion.h5 share. docs/run-file.md and docs/motion-file.md are the
/// descriptions for people.
namespace touchfield {

/// A text of a run's provenance and the attribute of /provenance that holds it.
struct ProvenanceField {
  const char* name;
  std::string Provenance::*value;
};

const std::vector<ProvenanceField>& provenance_fields();

/// True if the evaluation has a mesh of its own.
inline bool has_evaluation_model(const std::string& evaluation) {
  return evaluation == "truth" || evaluation == "edge" || evaluation == "split";
}

/// omni, piston or t4010a1.
std::string directivity_name(Directivity::Kind kind);

/// The wanted |p| of each face of a mesh, 0 off the target, M [Pa].
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
