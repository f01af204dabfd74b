#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nanobind/stl/pair.h>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/rigid_motion.h"
#include "sim/field/metrics.h"
#include "sim/field/target.h"
#include "sim/model/warnings.h"
#include "sim/run/methods.h"
#include "sim/run/run_data.h"
#include "sim/scene/scene_reader.h"

namespace touchfield::python {

namespace {

SharedModel model_of(const SceneInput& scene, const std::vector<std::string>& overrides) {
  return computed(0, [scene, overrides](Progress& progress) {
    Model model = build_model(scene.read(overrides));
    for (const std::string& warning : model_remarks(model).warnings) {
      progress.warn(warning);
    }
    return shared(std::move(model));
  });
}

SkinMesh skin_of(const SharedModel& model) {
  return {part_of(model, model->body.mesh), skin_mesh(model->body).landmarks};
}

/// None of a scene without a target.
std::optional<SharedTarget> target_of(const SharedModel& model) {
  if (!model->posture.target) {
    return std::nullopt;
  }
  Target target = build_target(*model);
  if (asks_for_best(*model)) {
    target.amplitudes.setConstant(kNotComputed);
  }
  return SharedTarget{shared(std::move(target)), skin_of(model)};
}

SharedTarget target_of_faces(const SkinMesh& skin, nb::handle faces, nb::handle amplitudes, nb::handle shares) {
  Target target;
  target.faces = index_list(faces, "Target: faces", skin.mesh->face_count());
  double pressure = 0;
  target.amplitudes = nb::try_cast(amplitudes, pressure)
                          ? Eigen::VectorXd::Constant(static_cast<Eigen::Index>(target.faces.size()), pressure)
                          : real_list(amplitudes, "Target: amplitudes");
  require_count("Target: amplitudes", target.amplitudes.size(), target.size(), "per face");
  target.shares =
      shares.is_none() ? Eigen::VectorXd::Ones(target.size()) : Eigen::VectorXd(real_list(shares, "Target: shares"));
  require_count("Target: shares", target.shares.size(), target.size(), "per face");
  require((target.shares.array() > 0).all() && (target.shares.array() <= 1).all(),
          "Target: shares must be > 0 and <= 1");
  target.box.assign(target.faces.size(), 0);
  if (std::ranges::adjacent_find(target.faces, std::greater_equal<>()) != target.faces.end()) {
    throw InputError("Target: faces must ascend, each of them once");
  }
  if (target.faces.empty() || !(target.amplitudes.array() >= 0).all() || target.amplitudes.maxCoeff() == 0) {
    throw InputError("Target: amplitudes must be >= 0, and one of them > 0");
  }
  return {shared(std::move(target)), skin};
}

SharedTarget target_of_state(const nb::tuple& state) {
  constexpr Eigen::Index kAny = std::numeric_limits<int>::max();
  Target target;
  target.faces = index_list(state[0], "Target: state", kAny);
  target.amplitudes = real_list(state[1], "Target: state");
  if (target.amplitudes.size() == 0) {
    target.amplitudes.setConstant(target.size(), kNotComputed);
  }
  const std::vector<Eigen::Index> box = index_list(state[2], "Target: state", kAny);
  target.box.assign(box.begin(), box.end());
  target.shares = real_list(state[3], "Target: state");
  return {shared(std::move(target)), nb::cast<SkinMesh>(state[4]), nb::cast<std::string>(state[5])};
}

void require_above_zero(const char* what, double value, const char* unit) {
  require(value > 0 && std::isfinite(value), "{} = {:g} {} must be > 0", what, value, unit);
}

SharedTarget target_of_box(const SkinMesh& skin, nb::handle centre, nb::handle size, nb::handle angles,
                           const std::string& profile, double pressure) {
  TargetBox box{three_numbers(centre, "Target.box: at"), three_numbers(size, "Target.box: size"),
                extrinsic_rotation(three_numbers(angles, "Target.box: rotate"))};
  box.key = "Target.box";
  require(box.size.minCoeff() > 0, "Target.box: size = ({:g}, {:g}, {:g}) m must be > 0", box.size.x(), box.size.y(),
          box.size.z());
  require_above_zero("Target.box: pressure", pressure, "Pa");
  if (profile != "uniform" && profile != "penetration") {
    throw InputError(fmt::format("Target.box: profile = '{}' must be uniform or penetration", profile));
  }
  const auto kind = profile == "uniform" ? TargetProfile::kUniform : TargetProfile::kPenetration;
  return {shared(make_target(*skin.mesh, {box}, kind, pressure)), skin};
}

SharedTarget target_of_discs(const SkinMesh& skin, nb::handle centres, double diameter, nb::handle pressures) {
  const Points at = point_rows(centres, "Target.points: points");
  const Eigen::VectorXd wanted = real_list(pressures, "Target.points: pressure");
  require_above_zero("Target.points: diameter", diameter, "m");
  require(at.cols() > 0, "Target.points: points must be one or more");
  require_count("Target.points: pressure", wanted.size(), at.cols(), "per point");
  require((wanted.array() > 0).all() && wanted.allFinite(), "Target.points: pressure must be > 0 Pa on each");
  const SkinStrokes strokes(*skin.mesh);
  std::vector<TargetBox> boxes;
  for (Eigen::Index i = 0; i < at.cols(); ++i) {
    boxes.push_back(
        strokes.disc(at.col(i), diameter, wanted(i) / wanted.maxCoeff(), fmt::format("Target.points: points[{}]", i)));
  }
  return {shared(make_target(*skin.mesh, boxes, TargetProfile::kUniform, wanted.maxCoeff())), skin};
}

SharedTarget target_of_strip(const SkinMesh& skin, nb::handle points, double width, double pressure) {
  const Points through = point_rows(points, "Target.line: points");
  require_above_zero("Target.line: width", width, "m");
  require_above_zero("Target.line: pressure", pressure, "Pa");
  require(through.cols() > 1, "Target.line: points = {} must be two or more", through.cols());
  const std::vector<Vector3> nodes(through.colwise().begin(), through.colwise().end());
  const std::vector<TargetBox> boxes = SkinStrokes(*skin.mesh).strip(nodes, width, 1.0, "Target.line");
  return {shared(make_target(*skin.mesh, boxes, TargetProfile::kUniform, pressure)), skin};
}

SharedTarget target_of_mask(const SkinMesh& skin, nb::handle levels, double pressure) {
  const Eigen::VectorXd given = real_list(levels, "Target.mask: levels");
  require_above_zero("Target.mask: pressure", pressure, "Pa");
  require_count("Target.mask: levels", given.size(), skin.mesh->face_count(), "per face");
  require((given.array() >= 0).all() && (given.array() <= 1).all() && (given.array() > 0).any(),
          "Target.mask: levels must be 0 to 1, one of them > 0");
  const std::vector<double> each(given.begin(), given.end());
  const TargetBox box = masked_box(*skin.mesh, each, "Target.mask");
  return {shared(make_target(*skin.mesh, {box}, TargetProfile::kUniform, pressure)), skin};
}

Numbers score(const SharedModel& model, const ArrayLike& pressure) {
  const std::string what = "score: pressure";
  const Eigen::VectorXcd p = complex_list(pressure, what);
  const TriangleMesh& mesh = model->body.mesh;
  require(model->fixed->cut.empty(),
          "score: keep_within_mm cuts the body, and metrics count its whole skin; leave it out, or use run()");
  require_count(what, p.size(), mesh.face_count(), "per face");
  if (!model->posture.target) {
    const Wave& wave = model->fixed->wave;
    return metrics_dict(metrics_of(mesh, p, radiation_pressure(SurfaceGradient(mesh, wave.k()), wave, p)));
  }
  return metrics_dict(*model, metrics_of(mesh, model->fixed->wave, model->boxes, build_target(*model), p));
}

}  // namespace

const Eigen::VectorXd& SharedTarget::amplitudes() const {
  require(!part->amplitudes.hasNaN(),
          "target: its scene asks for the best pressure, which is found with the phases: "
          "Problem.of_model(model).amplitudes has it. Or give target.pressure_pa a number");
  return part->amplitudes;
}

Numbers metrics_dict(const Metrics& metrics) {
  nb::dict values;
  for (const MetricField& field : metric_fields()) {
    values[field.name] = metrics.*field.value;
  }
  return named(values);
}

bool asks_for_best(const Model& model) { return model.posture.target && !model.posture.target->pressure; }

Numbers metrics_dict(const Model& model, Metrics metrics) {
  if (asks_for_best(model)) {
    metrics.scale = metrics.reached_share = metrics.relative_error_raw = kNotComputed;
  }
  return metrics_dict(metrics);
}

std::string path_of(nb::handle path) {
  const auto bytes = nb::cast<nb::bytes>(nb::module_::import_("os").attr("fsencode")(path));
  std::string text(bytes.c_str(), bytes.size());
  if (text.find('\0') != std::string::npos) {
    throw InputError(fmt::format("path {} must hold no null character", nb::cast<std::string>(nb::repr(path))));
  }
  return text;
}

Scene SceneInput::read(const std::vector<std::string>& overrides) const {
  return text ? read_scene_text(*text, name, "", overrides, "set") : read_scene(name, overrides);
}

SceneInput scene_input(nb::handle scene) {
  const nb::object source = nb::module_::import_("touchfield._scenes").attr("source")(scene);
  if (!nb::isinstance<nb::tuple>(source)) {
    return {path_of(source), std::nullopt};
  }
  const auto [text, name] = nb::cast<std::pair<std::string, std::string>>(source);
  return {name, text};
}

std::string text_of(nb::handle value, const char* what) {
  if (!nb::isinstance<nb::str>(value)) {
    throw nb::type_error(
        fmt::format("{} must be a str, not {}", what, nb::cast<std::string>(value.type().attr("__name__"))).c_str());
  }
  Py_ssize_t size = 0;
  const char* text = PyUnicode_AsUTF8AndSize(value.ptr(), &size);
  if (text == nullptr) {  // half of a surrogate pair
    throw nb::python_error();
  }
  return {text, static_cast<std::size_t>(size)};
}

nb::dict dict_of(nb::handle value, const char* argument) {
  if (!nb::isinstance<nb::dict>(value)) {
    throw nb::type_error(
        fmt::format("{} must be a dict, not {}", argument, nb::cast<std::string>(value.type().attr("__name__")))
            .c_str());
  }
  return nb::borrow<nb::dict>(value);
}

std::vector<std::string> overrides_of(nb::handle set, const std::optional<std::string>& device) {
  std::vector<std::string> overrides;
  if (!set.is_none()) {
    const nb::object dumps = nb::module_::import_("json").attr("dumps");
    const nb::object plain = nb::module_::import_("touchfield._plain").attr("plain");
    const nb::object written = nb::module_::import_("touchfield._scenes").attr("written")(dict_of(set, "set"));
    for (const auto& [key, value] : nb::cast<nb::dict>(written)) {  // JSON is YAML
      overrides.push_back(fmt::format("{}={}", text_of(key, "set: a key"),
                                      nb::cast<std::string>(dumps(value, nb::arg("default") = plain))));
    }
  }
  if (device) {
    overrides.push_back("solve.device=" + *device);
  }
  return overrides;
}

OwnMethod own_method(const std::string& name, nb::handle drives, const std::string& what) {
  OwnMethod own{what, {}};
  MethodSpec& method = own.method;
  method.kind = &phase_method("fixed");
  method.name = name;
  const auto keep = [&](const auto& phases, const auto& amplitudes) {
    method.phases.assign(phases.begin(), phases.end());
    method.amplitudes.assign(amplitudes.begin(), amplitudes.end());
  };
  if (nb::isinstance<SharedSolution>(drives)) {  // to the last bit
    const auto& solution = nb::cast<const SharedSolution&>(drives);
    keep(solution->phases, solution->amplitudes);
  } else if (nb::cast<bool>(nb::module_::import_("numpy").attr("iscomplexobj")(drives))) {
    const Eigen::VectorXcd q = complex_list(drives, what);
    const Eigen::ArrayXd amplitudes = q.cwiseAbs();
    keep(q.cwiseArg().eval(), ((amplitudes - 1).abs() <= kAmplitudeRounding).select(1.0, amplitudes).eval());
  } else {
    keep(real_list(drives, what), Eigen::VectorXd::Ones(1));
  }
  for (std::size_t n = 0; n < method.amplitudes.size(); ++n) {
    require(method.amplitudes[n] >= 0 && method.amplitudes[n] <= 1, "{}[{}]: the amplitude {:.9g} must be 0 to 1", what,
            n, method.amplitudes[n]);
  }
  if (std::ranges::adjacent_find(method.amplitudes, std::not_equal_to<>()) == method.amplitudes.end()) {
    method.amplitudes.resize(1);  // as a scene says it of all channels
  }
  return own;
}

Model with_own(const Model& model, const OwnMethods& own) {
  FixedModel fixed = *model.fixed;
  std::set<std::string> taken;
  for (const MethodSpec& method : model.fixed->scene.solve.methods) {
    taken.insert(method.name);
  }
  for (const auto& [what, method] : own) {
    require_name("own method", method.name, taken);
    require_count(what, static_cast<Eigen::Index>(method.phases.size()), model.fixed->array.size(), "per channel");
    fixed.scene.solve.methods.push_back(method);
  }
  Model with = model;
  with.fixed = std::make_shared<const FixedModel>(std::move(fixed));
  return with;
}

namespace {

void add_target(nb::module_& module) {
  nb::class_<SharedTarget>(module, "Target", nb::type_slots(kOpenInit),
                           R"(Faces of a mesh, the share of each that is meant, and the wanted pressure there.

Parameters
----------
mesh : Mesh
    The skin.
faces : array_like of int, shape (K,)
    Numbers of the faces, ascending.
amplitudes : array_like, shape (K,), or float
    Wanted pressure amplitudes [Pa].
shares : array_like, shape (K,), optional
    The share of each face's area that belongs to the target, above 0 and up to 1. All of it if left out.

Raises
------
InputError
    On a face that is missing or given twice, a share out of range, or if no pressure is wanted.

Examples
--------
>>> ball = tf.sphere(8e-3, 2e-3)
>>> below = np.flatnonzero(ball.normals[:, 2] < -0.9)
>>> target = tf.Target(ball, below, 800)
)")
      .def(
          "__init__",
          [](SharedTarget* self, const SkinMesh& mesh, const ArrayLike& faces, const ArrayLike& amplitudes,
             const ArrayLike& shares) { new (self) SharedTarget(target_of_faces(mesh, faces, amplitudes, shares)); },
          nb::arg("mesh"), nb::arg("faces"), nb::arg("amplitudes"), nb::arg("shares") = nb::none())
      .def_static("_box", &target_of_box, nb::arg("mesh"), nb::arg("at"), nb::arg("size"), nb::arg("rotate"),
                  nb::arg("profile"), nb::arg("pressure"))
      .def_static("_points", &target_of_discs, nb::arg("mesh"), nb::arg("points"), nb::arg("diameter"),
                  nb::arg("pressure"))
      .def_static("_line", &target_of_strip, nb::arg("mesh"), nb::arg("points"), nb::arg("width"), nb::arg("pressure"))
      .def_static("_mask", &target_of_mask, nb::arg("mesh"), nb::arg("levels"), nb::arg("pressure"))
      .def_rw("_keys", &SharedTarget::keys)
      .def_ro("mesh", &SharedTarget::skin, "The skin.")
      .def_prop_ro("faces", part_of<SharedTarget>(&Target::faces), "Numbers of the faces, shape (K,).")
      .def_prop_ro(
          "amplitudes",
          [](nb::handle_t<SharedTarget> self) { return view(nb::cast<const SharedTarget&>(self).amplitudes(), self); },
          "The wanted pressure amplitude on each [Pa], shape (K,). An error if the scene asks for the best one: "
          "`Problem.of_model` finds it.")
      .def_prop_ro("shares", part_of<SharedTarget>(&Target::shares),
                   "The share of each face's area that belongs to the target, 0 to 1, shape (K,). The rest is outside.")
      .def_prop_ro(
          "centre", [](const SharedTarget& self) { return central_face(*self.skin.mesh, *self); },
          "The number of the face nearest to the centre of the target, where `focus` aims.")
      .def("__getstate__",
           [](const SharedTarget& self) {
             const Eigen::VectorXd none(0);
             return nb::make_tuple(owned(self->faces), owned(self->amplitudes.hasNaN() ? none : self->amplitudes),
                                   owned(self->box), owned(self->shares), self.skin, self.keys);
           })
      .def("__setstate__",
           [](SharedTarget& self, const nb::tuple& state) { new (&self) SharedTarget(target_of_state(state)); })
      .def("__len__", [](const SharedTarget& self) { return self->size(); })
      .def("__repr__",
           [](const SharedTarget& self) { return fmt::format("<touchfield.Target: {} faces>", self->size()); });
}

}  // namespace

void add_models(nb::module_& module) {
  add_target(module);
  nb::class_<SharedModel>(module, "Model", nb::dynamic_attr(), nb::type_slots(kOpenInit),
                          R"(The mesh, array and target of a scene, with which a run computes, in the world's frame.

Parameters
----------
scene : str, os.PathLike or dict
    A file, YAML text, or a dict with the keys of a scene. In a dict a `Mesh` may stand for `body` or `mesh`, an `Array`
    for `array`, a `Target` for `target`.
set : dict, optional
    Changes of the scene by key path: ``{"solve.iterations": 10}``.
device : {"auto", "cpu", "cuda", "cuda:N"}, optional

Raises
------
InputError
    That lists every problem of the scene.

Examples
--------
>>> model = tf.Model("capsule", set={"target.pressure_pa": 500})
>>> parts = {"array": model.array, "body": model.mesh, "solve": {"methods": ["focus"]},
...          "target": tf.Target.box(model.mesh, "bottom", [8e-3, 20e-3, 6e-3], 500)}
>>> len(tf.Model(parts).mesh) == len(model.mesh)
True
)")
      .def(
          "__init__",
          [](nb::pointer_and_handle<SharedModel> self, const SceneLike& scene, const Changes& set,
             const std::optional<std::string>& device) {
            new (self.p) SharedModel(model_of(scene_input(scene), overrides_of(set, device)));
            if (nb::isinstance<nb::dict>(scene)) {  // for another process, where the files of its objects are not
              nb::setattr(self.h, "_given", nb::make_tuple(scene, set, device));
            }
          },
          nb::arg("scene"), nb::arg("set") = nb::none(), nb::arg("device") = nb::none())
      .def_prop_ro(
          "name", [](const SharedModel& self) { return self->fixed->scene.name; }, "Of the scene.")
      .def_prop_ro(
          "scene", [](const SharedModel& self) { return resolved_yaml(self->fixed->scene); },
          "The scene as YAML with all defaults.")
      .def_prop_ro("mesh", &skin_of, "The skin, a `Mesh` with landmarks.")
      .def_prop_ro(
          "array", [](const SharedModel& self) { return SharedArray{part_of(self, self->fixed->array)}; },
          "The transducers, an `Array`.")
      .def_prop_ro(
          "wave", [](const SharedModel& self) { return self->fixed->wave; }, "The sound, a `Wave`.")
      .def_prop_ro("target", &target_of, "The `Target`; None if the scene has none.")
      .def("score", &score, nb::arg("pressure"), R"(The metrics of a pressure on the skin.

Parameters
----------
pressure : array_like of complex, shape (M,)
    On every face of the mesh [Pa], of `scatter` or ``H @ drives``.

Examples
--------
>>> model = tf.Model("capsule")
>>> model.score(np.ones(len(model.mesh)))["peak_pa"]
1.0
)")
      .def("__repr__", [](const SharedModel& self) {
        return fmt::format("<touchfield.Model {}: {} faces, {} channels>", self->fixed->scene.name,
                           self->body.mesh.face_count(), self->fixed->array.size());
      });
}

}  // namespace touchfield::python
