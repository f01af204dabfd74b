#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "python/src/arrays.h"
#include "sim/felt/skin_patch.h"
#include "sim/hand/body.h"
#include "sim/model/model.h"
#include "sim/run/run_data.h"
#include "sim/scene/scene.h"
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

/// With what a scene says of it, as JSON of its key `array`: all of it, what it says beside the layout, or "".
struct SharedArray : Shared<TransducerArray> {
  std::string keys{};
};

/// Faces of a skin, with the keys of `target` in a scene, as JSON; "" where a scene cannot say it.
/// The amplitudes are NaN where a scene asks for the best pressure, which is found with the phases.
struct SharedTarget : Shared<Target> {
  SkinMesh skin{};
  std::string keys{};

  /// throws   InputError that says where the amplitudes are, if they are NaN
  const Eigen::VectorXd& amplitudes() const;
};

using SharedModel = Shared<Model>;
using SharedProblem = Shared<SkinProblem>;
using SharedRun = Shared<Run>;
using SharedSolution = Shared<PhaseSolution>;

void add_shapes(nb::module_& module);
void add_arrays(nb::module_& module);
void add_methods(nb::module_& module);
void add_models(nb::module_& module);
void add_problems(nb::module_& module);
void add_radiation(nb::module_& module);
void add_runs(nb::module_& module);
void add_scattering(nb::module_& module);
void add_motions(nb::module_& module);
void add_reports(nb::module_& module);
void add_emission(nb::module_& module);
void add_felt(nb::module_& module);

/// The attributes middle, axes, faces, places and areas of a patch that `owner` keeps.
nb::object flat(const SkinPatch& patch, nb::handle owner);

/// Of none, that of 40 kHz at 20 degrees C.
Wave wave_or_default(const std::optional<Wave>& wave);

/// A dict of results, for which an old key is an error with the new one (touchfield/_plain.py).
nb::object named(nb::handle values);

/// Numbers by name.
Numbers numbers_dict(const std::vector<std::pair<std::string, double>>& values);

/// Metrics by name; NaN where not computed.
Numbers metrics_dict(const Metrics& metrics);

/// A dict of what `value` makes of every method of a run or motion; their names.
template <typename Whole, typename Value>
nb::dict by_method(const Whole& whole, Value value) {
  nb::dict values;
  for (const auto& method : whole.methods) {
    values[method.name.c_str()] = value(method);
  }
  return values;
}
template <typename Methods>
std::vector<std::string> names_of(const Methods& methods) {
  std::vector<std::string> names;
  for (const auto& method : methods) {
    names.push_back(method.name);
  }
  return names;
}

/// A method of one's own: what it found, as method `fixed`.
struct OwnMethod {
  std::string what;  // the argument in messages
  MethodSpec method;
};
using OwnMethods = std::vector<OwnMethod>;

/// Of complex drives an amplitude so near to 1 is 1: of exp(i phase) in single precision.
inline constexpr double kAmplitudeRounding = 1e-6;

/// Of a Solution, of real phases, whose amplitudes are 1, or of a complex drive vector.
/// throws   InputError on an amplitude above 1
OwnMethod own_method(const std::string& name, nb::handle drives, const std::string& what);

/// A model whose scene has these methods too.
/// throws   InputError on a name that is taken or cannot be one, or drives that do not fit the channels
Model with_own(const Model& model, const OwnMethods& own);

bool asks_for_best(const Model& model);

/// Those that compare with the wanted pressure are NaN where the model's scene asks for the best one.
Numbers metrics_dict(const Model& model, Metrics metrics);

/// What the results of a run and of a motion both have.
///
/// skin   what is said of `mesh`
template <typename Whole>
void add_results(nb::class_<Shared<Whole>>& kind, const char* skin) {
  using Held = Shared<Whole>;
  kind.def_prop_ro(
          "name", [](const Held& self) { return self->name; }, "Of the scene.")
      .def_prop_ro(
          "scene", [](const Held& self) { return self->scene; }, "The scene as YAML with all defaults.")
      .def_prop_ro(
          "mesh", [](const Held& self) { return SkinMesh{part_of(self, self->mesh)}; }, skin)
      .def_prop_ro(
          "array", [](const Held& self) { return SharedArray{part_of(self, self->array)}; },
          "The transducers, an `Array`.")
      .def_prop_ro(
          "methods", [](const Held& self) { return names_of(self->methods); }, "Names of the methods.")
      .def_prop_ro(
          "warnings", [](const Held& self) { return self->warnings; }, "Anything that makes a result unreliable.")
      .def_prop_ro(
          "notes", [](const Held& self) { return self->notes; }, "Information about results that are reliable.");
}

/// A path, of whatever Python takes for one.
std::string path_of(nb::handle path);

/// A scene as Python hands it over (touchfield/_scenes.py): a file, or a text whose paths count from the working
/// directory.
struct SceneInput {
  std::string name;  // the path, or what messages call the text
  std::optional<std::string> text;

  /// throws   InputError as read_scene
  Scene read(const std::vector<std::string>& overrides) const;
};

/// Of a path, a text, or a dict with objects in it.
SceneInput scene_input(nb::handle scene);

/// throws   nanobind's type_error that names what it is, Python's UnicodeEncodeError on half of a surrogate pair
std::string text_of(nb::handle value, const char* what);

/// throws   nanobind's type_error that names the argument unless the value is a dict
nb::dict dict_of(nb::handle value, const char* argument);

/// "key.path=value" of the argument `set`, a dict of objects and values that JSON can spell, and of `device`.
/// throws   nanobind's type_error on a value that it cannot
std::vector<std::string> overrides_of(nb::handle set, const std::optional<std::string>& device);

}  // namespace touchfield::python
