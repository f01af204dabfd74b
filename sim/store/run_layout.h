#pragma once

#include <string>
#include <vector>

#include "sim/store/run_data.h"

/// What the writer and the reader of run.h5 share. docs/run-file.md is the description for people.
namespace touchfield {

inline constexpr const char* kRunFormat = "touchfield-run";

/// A text of a run's provenance and the attribute of /provenance that holds it.
struct ProvenanceField {
  const char* name;
  std::string Provenance::*value;
};

const std::vector<ProvenanceField>& provenance_fields();

/// True if the judge has a mesh of its own.
inline bool has_judge_model(const std::string& judge) {
  return judge == "truth" || judge == "edge" || judge == "split";
}

/// omni, piston or t4010a1.
std::string directivity_name(Directivity::Kind kind);

/// throws   InputError naming the first part of the run whose size does not fit the rest, and any name of a method,
///          field or stage that cannot be stored
void check_run(const Run& run);

/// The same for one field by itself.
void check_field(const FieldResult& field);

}  // namespace touchfield
