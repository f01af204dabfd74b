#pragma once

#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sim/store/hdf5_file.h"
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

/// Calls visit(name, member, unit) for every part of a SolveRecord: each is a dataset of /solves, a value a solve.
template <class Visit>
void for_each_solve_column(const Visit& visit) {
  visit("stage", &SolveRecord::stage, "text");
  visit("scheme", &SolveRecord::scheme, "text");
  visit("solver", &SolveRecord::solver, "text");
  visit("precision", &SolveRecord::precision, "text");
  visit("unknowns", &SolveRecord::unknowns, "1");
  visit("right_hand_sides", &SolveRecord::right_hand_sides, "1");
  visit("steps", &SolveRecord::steps, "1");
  visit("refinements", &SolveRecord::refinements, "1");
  visit("residual", &SolveRecord::residual, "1");
  visit("converged", &SolveRecord::converged, "1");
  visit("seconds", &SolveRecord::seconds, "s");
}

/// What a number of a SolveRecord is stored as.
template <class Value>
using StoredNumber = std::conditional_t<std::is_same_v<Value, double>, double, std::int64_t>;

/// True if the judge has a mesh of its own.
inline bool has_judge_model(const std::string& judge) {
  return judge == "truth" || judge == "edge" || judge == "split";
}

/// omni, piston or t4010a1.
std::string directivity_name(Directivity::Kind kind);

/// The product k b of a piston, from which Directivity::piston(k b, 1) makes the same directivity again.
double piston_ka(const Directivity& directivity);

/// Shape of values on a grid, z slowest.
hdf5::Shape grid_shape(const FieldGrid& grid);

/// throws   InputError naming the first part of the run whose size does not fit the rest, and any name of a method,
///          field or stage that cannot be stored
void check_run(const Run& run);

/// The same for one field by itself.
void check_field(const FieldResult& field);

}  // namespace touchfield
