#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "python/src/arrays.h"
#include "sim/body/body.h"
#include "sim/solve/model.h"
#include "sim/store/run_data.h"
#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"

/// What Python holds: parts of the library that are shared and never changed, so that a computation may go on with them
/// whatever becomes of Python's own objects.
namespace touchfield::python {

template <typename Part>
struct Shared {
  std::shared_ptr<const Part> part;

  const Part& operator*() const { return *part; }
  const Part* operator->() const { return part.get(); }
};

template <typename Part>
Shared<Part> shared(Part part) {
  return {std::make_shared<const Part>(std::move(part))};
}

/// A part of a whole, which it keeps.
template <typename Part, typename Whole>
Shared<Part> part_of(const Shared<Whole>& whole, const Part& part) {
  return {std::shared_ptr<const Part>(whole.part, &part)};
}

/// Landmarks are in the mesh's frame [m].
struct SkinMesh {
  Shared<TriangleMesh> mesh;
  std::map<std::string, Vector3> landmarks{};
};

SkinMesh skin_mesh(const Body& body);

using SharedArray = Shared<TransducerArray>;
using SharedModel = Shared<Model>;
using SharedProblem = Shared<SkinProblem>;
using SharedRun = Shared<Run>;
using SharedSolution = Shared<PhaseSolution>;
using SharedTarget = Shared<Target>;

void add_errors(nb::module_& module);
void add_shapes(nb::module_& module);
void add_arrays(nb::module_& module);
void add_models(nb::module_& module);
void add_problems(nb::module_& module);
void add_runs(nb::module_& module);
void add_batch(nb::module_& module);

/// Metrics by name; NaN where not computed.
nb::dict metrics_dict(const Metrics& metrics);

/// A path, of whatever Python takes for one.
std::string path_of(nb::handle path);

/// throws   nanobind's type_error that names what it is, Python's UnicodeEncodeError on half of a surrogate pair
std::string text_of(nb::handle value, const char* what);

/// throws   nanobind's type_error that names the argument unless the value is a dict
nb::dict dict_of(nb::handle value, const char* argument);

/// "key.path=value" of the argument `set`, a dict of values that JSON can spell, and of `device`.
/// throws   nanobind's type_error on a value that it cannot
std::vector<std::string> overrides_of(nb::handle set, const std::optional<std::string>& device);

}  // namespace touchfield::python
