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

/// None of a scene without a target.
std::optional<SharedTarget> target_of(const SharedModel& model) {
  if (!model->posture.target) {
    return std::nullopt;
  }
  return shared(build_target(*model));
}

Vector3 three_numbers(nb::handle value, const std::string& what) {
  const Eigen::VectorXd numbers = real_list(value, what);
  require_count(what, numbers.size(), 3, "per axis");
  return numbers;
}

SharedTarget target_of_faces(const SkinMesh& skin, nb::handle faces, nb::handle amplitudes) {
  Target target;
  target.faces = index_list(faces, "Target: faces", skin.mesh->face_count());
  target.amplitudes = real_list(amplitudes, "Target: amplitudes");
  require_count("Target: amplitudes", target.amplitudes.size(), target.size(), "per face");
  target.box.assign(target.faces.size(), 0);
  if (std::ranges::adjacent_find(target.faces, std::greater_equal<>()) != target.faces.end()) {
    throw InputError("Target: faces must ascend, each of them once");
  }
  if (target.faces.empty() || (target.amplitudes.array() < 0).any() || target.amplitudes.maxCoeff() == 0) {
    throw InputError("Target: amplitudes must be >= 0, and one of them > 0");
  }
  return shared(std::move(target));
}

Target target_of_state(const nb::tuple& state) {
  constexpr Eigen::Index kAny = std::numeric_limits<int>::max();
  Target target;
  target.faces = index_list(state[0], "Target: state", kAny);
  target.amplitudes = real_list(state[1], "Target: state");
  const std::vector<Eigen::Index> box = index_list(state[2], "Target: state", kAny);
  target.box.assign(box.begin(), box.end());
  return target;
}

void require_above_zero(const char* what, double value, const char* unit) {
  require(value > 0 && std::isfinite(value), "{} = {:g} {} must be > 0", what, value, unit);
}

SharedTarget target_of_box(const SkinMesh& skin, nb::handle centre, nb::handle size, nb::handle angles,
                           const std::string& profile, double pressure) {
  const TargetBox box{three_numbers(centre, "Target.box: at"), three_numbers(size, "Target.box: size"),
                      extrinsic_rotation(three_numbers(angles, "Target.box: rotate"))};
  if (!(box.size.minCoeff() > 0)) {
    throw InputError(
        fmt::format("Target.box: size = ({:g}, {:g}, {:g}) m must be > 0", box.size.x(), box.size.y(), box.size.z()));
  }
  require_above_zero("Target.box: pressure", pressure, "Pa");
  if (profile != "uniform" && profile != "penetration") {
    throw InputError(fmt::format("Target.box: profile = '{}' must be uniform or penetration", profile));
  }
  return shared(make_target(*skin.mesh, {box},
                            profile == "uniform" ? TargetProfile::kUniform : TargetProfile::kPenetration, pressure));
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
  return shared(make_target(*skin.mesh, boxes, TargetProfile::kUniform, wanted.maxCoeff()));
}

SharedTarget target_of_strip(const SkinMesh& skin, nb::handle points, double width, double pressure) {
  const Points through = point_rows(points, "Target.line: points");
  require_above_zero("Target.line: width", width, "m");
  require_above_zero("Target.line: pressure", pressure, "Pa");
  require(through.cols() > 1, "Target.line: points = {} must be two or more", through.cols());
  const std::vector<Vector3> nodes(through.colwise().begin(), through.colwise().end());
  const std::vector<TargetBox> boxes = SkinStrokes(*skin.mesh).strip(nodes, width, 1.0, "Target.line");
  return shared(make_target(*skin.mesh, boxes, TargetProfile::kUniform, pressure));
}

SharedTarget target_of_mask(const SkinMesh& skin, nb::handle levels, double pressure) {
  const Eigen::VectorXd given = real_list(levels, "Target.mask: levels");
  require_above_zero("Target.mask: pressure", pressure, "Pa");
  require_count("Target.mask: levels", given.size(), skin.mesh->face_count(), "per face");
  require((given.array() >= 0).all() && (given.array() <= 1).all() && (given.array() > 0).any(),
          "Target.mask: levels must be 0 to 1, one of them > 0");
  const std::vector<double> each(given.begin(), given.end());
  return shared(
      make_target(*skin.mesh, {masked_box(*skin.mesh, each, "Target.mask")}, TargetProfile::kUniform, pressure));
}

Eigen::Index central_face_of(const SharedTarget& target, const SkinMesh& skin) {
  return central_face(*skin.mesh, *target);
}

nb::dict score(const SharedModel& model, nb::handle pressure) {
  const std::string what = "score: pressure";
  const Eigen::VectorXcd p = complex_list(pressure, what);
  const TriangleMesh& mesh = model->body.mesh;
  require(model->fixed->cut.empty(),
          "score: keep_within_mm cuts the body, and metrics count its whole skin; leave it out, or use run()");
  require_count(what, p.size(), mesh.face_count(), "per face");
  if (!model->posture.target) {
    return metrics_dict(metrics_of(mesh, SurfaceGradient(mesh, model->fixed->wave.k()), model->fixed->wave, p));
  }
  return metrics_dict(metrics_of(mesh, model->fixed->wave, model->boxes, build_target(*model), p));
}

}  // namespace

nb::dict metrics_dict(const Metrics& metrics) {
  nb::dict values;
  for (const MetricField& field : metric_fields()) {
    values[field.name] = metrics.*field.value;
  }
  return values;
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
  if (!nb::isinstance<nb::tuple>(scene)) {
    return {path_of(scene), std::nullopt};
  }
  const auto [text, name] = nb::cast<std::pair<std::string, std::string>>(scene);
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
    for (const auto& [key, value] : dict_of(set, "set")) {  // JSON is YAML
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
  if (!nb::cast<bool>(nb::module_::import_("numpy").attr("iscomplexobj")(drives))) {
    return {name, real_list(drives, what)};
  }
  constexpr double kRounding = 1e-9;
  const Eigen::VectorXcd q = complex_list(drives, what);
  for (Eigen::Index n = 0; n < q.size(); ++n) {
    if (std::abs(std::abs(q(n)) - 1) > kRounding) {
      throw InputError(
          fmt::format("{}[{}] has the amplitude {:g}; here channels are at full drive, with amplitude 1. Model.score() "
                      "of scatter() evaluates drive vectors of any amplitudes",
                      what, n, std::abs(q(n))));
    }
  }
  return {name, q.cwiseArg()};
}

Model with_own(const Model& model, const OwnMethods& own) {
  FixedModel fixed = *model.fixed;
  std::set<std::string> taken;
  for (const MethodSpec& method : model.fixed->scene.solve.methods) {
    taken.insert(method.name);
  }
  for (const auto& [name, phases] : own) {
    require_name("own method", name, taken);
    MethodSpec method;
    method.kind = &phase_method("fixed");
    method.name = name;
    method.phases.assign(phases.begin(), phases.end());
    require_fitting_phases(method, model.fixed->array.size());
    fixed.scene.solve.methods.push_back(std::move(method));
  }
  Model with = model;
  with.fixed = std::make_shared<const FixedModel>(std::move(fixed));
  return with;
}

void add_models(nb::module_& module) {
  nb::class_<SharedTarget>(module, "Target", "The faces of the target.")
      .def(
          "__init__",
          [](SharedTarget* self, const SkinMesh& skin, nb::handle faces, nb::handle amplitudes) {
            new (self) SharedTarget(target_of_faces(skin, faces, amplitudes));
          },
          nb::arg("mesh"), nb::arg("faces"), nb::arg("amplitudes"),
          nb::sig("def __init__(self, mesh: Mesh, faces: numpy.typing.ArrayLike, amplitudes: numpy.typing.ArrayLike) "
                  "-> None"))
      .def_static("box", &target_of_box, nb::arg("mesh"), nb::arg("centre"), nb::arg("size"), nb::arg("angles"),
                  nb::arg("profile"), nb::arg("pressure"),
                  nb::sig("def box(mesh: Mesh, centre: numpy.typing.ArrayLike, size: numpy.typing.ArrayLike, angles: "
                          "numpy.typing.ArrayLike, profile: str, pressure: float) -> Target"),
                  "The faces with their centroids in a box; lengths in m, angles in rad.")
      .def_static("discs", &target_of_discs, nb::arg("mesh"), nb::arg("centres"), nb::arg("diameter"),
                  nb::arg("pressures"),
                  nb::sig("def discs(mesh: Mesh, centres: numpy.typing.ArrayLike, diameter: float, pressures: "
                          "numpy.typing.ArrayLike) -> Target"),
                  "The faces in discs on the skin about the points nearest to these [m].")
      .def_static("strip", &target_of_strip, nb::arg("mesh"), nb::arg("points"), nb::arg("width"), nb::arg("pressure"),
                  nb::sig("def strip(mesh: Mesh, points: numpy.typing.ArrayLike, width: float, pressure: float) "
                          "-> Target"),
                  "The faces in a strip on the skin through the points nearest to these [m].")
      .def_static("mask", &target_of_mask, nb::arg("mesh"), nb::arg("levels"), nb::arg("pressure"),
                  nb::sig("def mask(mesh: Mesh, levels: numpy.typing.ArrayLike, pressure: float) -> Target"),
                  "The faces whose level is above 0.")
      .def("central_face", &central_face_of, nb::arg("mesh"), "The number of the face nearest to the centre.")
      .def_prop_ro("faces", part_of<SharedTarget>(&Target::faces))
      .def_prop_ro("amplitudes", part_of<SharedTarget>(&Target::amplitudes), "The wanted pressure on each [Pa].")
      .def(
          "__getstate__",
          [](const SharedTarget& self) {
            return nb::make_tuple(owned(self->faces), owned(self->amplitudes), owned(self->box));
          },
          nb::sig("def __getstate__(self) -> tuple[typing.Any, ...]"))
      .def(
          "__setstate__",
          [](SharedTarget& self, const nb::tuple& state) { new (&self) SharedTarget(shared(target_of_state(state))); },
          nb::sig("def __setstate__(self, state: tuple[typing.Any, ...]) -> None"))
      .def("__len__", [](const SharedTarget& self) { return self->size(); })
      .def("__repr__",
           [](const SharedTarget& self) { return fmt::format("<touchfield.Target: {} faces>", self->size()); });
  nb::class_<SharedModel>(module, "Model", "The model of a scene, with which a run computes, in the world's frame.")
      .def(
          "__init__",
          [](SharedModel* self, nb::handle scene, nb::handle set, const std::optional<std::string>& device) {
            new (self) SharedModel(model_of(scene_input(scene), overrides_of(set, device)));
          },
          nb::arg("scene"), nb::arg("set") = nb::none(), nb::arg("device") = nb::none(),
          nb::sig("def __init__(self, scene: str | os.PathLike | tuple[str, str], set: dict[str, typing.Any] | None = "
                  "None, device: str | None = None) -> None"))
      .def_prop_ro("name", [](const SharedModel& self) { return self->fixed->scene.name; })
      .def_prop_ro(
          "scene", [](const SharedModel& self) { return resolved_yaml(self->fixed->scene); },
          "The scene as YAML with all defaults.")
      .def_prop_ro("mesh",
                   [](const SharedModel& self) {
                     SkinMesh skin{part_of(self, self->body.mesh)};
                     skin.landmarks = skin_mesh(self->body).landmarks;
                     return skin;
                   })
      .def_prop_ro("array", [](const SharedModel& self) { return part_of(self, self->fixed->array); })
      .def_prop_ro("wave", [](const SharedModel& self) { return self->fixed->wave; })
      .def_prop_ro("target", &target_of)
      .def("score", &score, nb::arg("pressure"),
           nb::sig("def score(self, pressure: numpy.typing.ArrayLike) -> dict[str, float]"),
           "The metrics of a pressure on every face of the mesh [Pa].")
      .def("__repr__", [](const SharedModel& self) {
        return fmt::format("<touchfield.Model {}: {} faces, {} channels>", self->fixed->scene.name,
                           self->body.mesh.face_count(), self->fixed->array.size());
      });
}

}  // namespace touchfield::python
