#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/field/target_parts.h"
#include "sim/jobs/run_model.h"
#include "sim/pictures/figures.h"
#include "sim/pictures/skin_picture.h"
#include "sim/run/check.h"
#include "sim/run/evaluate_methods.h"
#include "sim/run/run_data.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"
#include "sim/run/scan_comparison.h"
#include "sim/scene/scene_reader.h"
#include "sim/scene/shipped_scenes.h"
#include "sim/view/view_page.h"

namespace touchfield::python {

namespace {

using GridArrays = Said<"dict[str, dict[str, numpy.typing.NDArray[typing.Any]]]">;
using ProblemsByName = Said<"dict[str, Problem]">;

/// A picture as the bytes of its file.
struct Picture {
  std::string bytes;
};

SharedRun solved(const Model& model, Progress& progress) {
  require_memory(check_model(model));
  SolveOptions options;
  options.command_line = "touchfield.run() of Python";
  options.threads = omp_get_max_threads();
  return shared(solve_model(
      model, options, [](const Run&) {}, progress));
}

using RunnableLike = Said<"str | os.PathLike | dict | Model">;

SharedRun run(const RunnableLike& scene, const Changes& set, const std::optional<std::string>& device,
              std::optional<int> threads, const Changes& own) {
  OwnMethods methods;
  if (!own.is_none()) {
    for (const auto& [name, phases] : dict_of(own, "own")) {
      const std::string text = text_of(name, "own: a name");
      methods.push_back(own_method(text, phases, fmt::format("run: own['{}']", text)));
    }
  }
  const int count = thread_count(threads);
  if (nb::isinstance<SharedModel>(scene)) {
    if (!set.is_none() || device) {
      throw InputError("run: set and device need a scene file; a Model already has its own");
    }
    return computed(count, [model = nb::cast<SharedModel>(scene), methods](Progress& progress) {
      return solved(with_own(*model, methods), progress);
    });
  }
  return computed(count,
                  [input = scene_input(scene), overrides = overrides_of(set, device), methods](Progress& progress) {
                    return solved(with_own(build_model(input.read(overrides)), methods), progress);
                  });
}

Scene scene_of(const Run& run) { return read_scene_text(run.scene, "run " + run.name, ""); }

void save(const SharedRun& run, const PathLike& path, bool force) {
  do_work(0, [run, place = path_of(path), force](Progress& progress) {
    if (!place.ends_with(".h5")) {
      filled(written_job(*run, scene_of(*run)), place, force, progress);
    } else {
      require_free(place, force, "force=True replaces it");
      write_run_file(place, *run);
    }
  });
}

void save_picture(const Picture& picture, const PathLike& path) {
  const std::string place = path_of(path);
  if (!place.ends_with(".png")) {
    throw InputError(
        fmt::format("{}: the name of a picture must end in .png; figures for print come from run.figure()", place));
  }
  write_atomically(place, {picture.bytes});
}

Picture picture_of(const SharedRun& run, const std::optional<std::string>& picture) {
  return computed(0,
                  [run, name = picture.value_or("overview")](Progress&) { return Picture{draw_figure(name, *run)}; });
}

/// Views of something in a run, by method.
template <typename Arrays, typename Member>
auto views_by_method(Member member) {
  return [member](nb::handle_t<SharedRun> self) {
    return Arrays(by_method(*nb::cast<const SharedRun&>(self),
                            [&](const MethodResult& method) { return view(member(method), self); }));
  };
}

/// Triangles of the faces that a target holds only in part: their corners, nine numbers each [m], and the faces.
std::pair<std::vector<double>, std::vector<Eigen::Index>> cut_faces(const TriangleMesh& mesh, const Target& target) {
  std::vector<double> corners;
  std::vector<Eigen::Index> faces;
  for (const FacePart& part : face_parts(mesh, target.boxes)) {
    for (std::size_t i = 2; i < part.corners.size(); ++i) {
      for (const std::size_t corner : {std::size_t{0}, i - 1, i}) {
        corners.insert(corners.end(), part.corners[corner].begin(), part.corners[corner].end());
      }
      faces.push_back(part.face);
    }
  }
  return {std::move(corners), std::move(faces)};
}

/// What figures need of the evaluated skin: the direction in which the array faces, and of a target its border.
nb::dict drawing(const SharedRun& run) {
  const TriangleMesh& mesh = evaluated_mesh(*run);
  const auto& target = run->evaluation_model ? run->evaluation_model->target : run->target;
  nb::dict values;
  values["sight"] = owned(Eigen::VectorXd(facing(run->array, mesh.centroids().rowwise().mean())));
  values["radiation_per_square"] = run->radiation_per_square;
  if (target) {
    values["target"] = SharedTarget{part_of(run, *target), SkinMesh{part_of(run, mesh)}};
    values["outline"] = owned(target_outline(mesh, *target));
    auto [corners, faces] = cut_faces(mesh, *target);
    values["cut_corners"] = owned(std::move(corners));
    values["cut_faces"] = owned(std::move(faces));
  }
  return values;
}

Wave wave_of(const Run& run) {
  const Scene scene = scene_of(run);
  return {build_medium(scene.medium, scene.frequency), scene.frequency};
}

ComplexArrays field_at(const SharedRun& run, const ArrayLike& points, std::optional<int> threads,
                       const std::optional<Wave>& wave) {
  const Points at = point_rows(points, "Run.field: points");
  const Wave sound = wave ? *wave : wave_of(*run);
  const Eigen::MatrixXcd pressure =
      computed(thread_count(threads), [run, at, sound](Progress&) { return run_field(*run, sound, at).pressure; });
  nb::dict values;
  for (std::size_t s = 0; s < run->methods.size(); ++s) {
    values[run->methods[s].name.c_str()] = owned(Eigen::VectorXcd(pressure.col(static_cast<Eigen::Index>(s))));
  }
  return values;
}

Values provenance(const SharedRun& run) {
  nb::dict values;
  for (const ProvenanceField& field : provenance_fields()) {
    values[field.name] = run->provenance.*field.value;
  }
  values["threads"] = run->provenance.threads;
  return values;
}

/// A grid's values in the order of its axes, z first.
GridArrays grids(const SharedRun& run, nb::handle self) {
  using Grid = nb::ndarray<nb::numpy, const Complex, nb::shape<-1, -1, -1>, nb::c_contig>;
  nb::dict fields;
  for (const FieldResult& field : run->fields) {
    const auto& [nx, ny, nz] = field.grid.count;
    nb::dict values;
    for (const auto& [method, pressure] : field.pressure) {
      values[method.c_str()] =
          Grid(pressure.data(),
               {static_cast<std::size_t>(nz), static_cast<std::size_t>(ny), static_cast<std::size_t>(nx)}, self);
    }
    values["points"] = owned(field.grid.points()).attr("reshape")(nz, ny, nx, 3);
    fields[field.grid.name.c_str()] = values;
  }
  return fields;
}

nb::bytes bytes_of(const Picture& picture) { return nb::bytes(picture.bytes.data(), picture.bytes.size()); }

void add_picture(nb::module_& module) {
  nb::class_<Picture>(module, "Picture", "A picture made by the program, as PNG; Jupyter displays it.")
      .def("_repr_png_", &bytes_of)
      .def("__bytes__", &bytes_of)
      .def("__reduce__",
           [](const Picture& /*self*/) {
             throw nb::type_error("a picture cannot be pickled; bytes(picture) are those of its PNG file");
           })
      .def("save", &save_picture, nb::arg("path"), R"(Writes it into a file.

Parameters
----------
path : str or os.PathLike
    That ends in .png.

Examples
--------
>>> tf.run("capsule", set={"solve.methods": ["focus"]}).picture().save("overview.png")
)");
}

/// What it is of.
void add_inputs(nb::class_<SharedRun>& run) {
  run.def_prop_ro(
         "target",
         [](const SharedRun& self) -> std::optional<SharedTarget> {
           if (!self->target) {
             return std::nullopt;
           }
           return SharedTarget{part_of(self, *self->target), SkinMesh{part_of(self, self->mesh)}};
         },
         "The `Target`; None if the scene has none.")
      .def_prop_ro(
          "evaluation", [](const SharedRun& self) { return self->evaluation; },
          "The evaluation mesh: none, same, truth, edge or split.")
      .def_prop_ro(
          "solved_skin", [](const SharedRun& self) { return to_string(self->solved_skin); },
          "Extent of the skin in `mesh` and `pressures`: 'whole', or 'part' (within keep_within_mm).")
      .def_prop_ro(
          "evaluation_mesh",
          [](const SharedRun& self) -> std::optional<SkinMesh> {
            return self->evaluation_model ? std::optional(SkinMesh{part_of(self, self->evaluation_model->mesh)})
                                          : std::nullopt;
          },
          "The evaluation mesh, if it is one of its own.")
      .def_prop_ro("_wave", [](const SharedRun& self) { return wave_of(*self); })
      .def("_drawing", &drawing)
      .def("_page", [](const SharedRun& self) { return computed(0, [self](Progress&) { return run_page(*self); }); })
      .def(
          "_clear",
          [](const SharedRun& self, const ArrayLike& points) {
            return clear_points(*self, point_rows(points, "Run.clear: points"));
          },
          nb::arg("points"),
          "Whether points lie off the body, no nearer to its skin than the longest edge of the face there.");
}

/// What every method found.
void add_methods(nb::class_<SharedRun>& run) {
  run.def_prop_ro(
         "metrics",
         [](const SharedRun& self) {
           return NumbersByName(
               by_method(*self, [](const MethodResult& method) { return metrics_dict(method.metrics); }));
         },
         "By method and name; NaN where not computed.")
      .def_prop_ro(
          "status",
          [](const SharedRun& self) {
            return TextByName(
                by_method(*self, [](const MethodResult& method) { return to_string(method.solution.status); }));
          },
          "By method: converged, iteration_limit, stalled or direct.")
      .def_prop_ro("pressures",
                   views_by_method<ComplexArrays>([](const MethodResult& method) -> auto& { return method.pressure; }),
                   "By method, on every face of `mesh` [Pa], complex.")
      .def_prop_ro("phases", views_by_method<RealArrays>([](const MethodResult& method) -> auto& {
                     return method.solution.phases;
                   }),
                   "By method, of every channel [rad].")
      .def_prop_ro("amplitudes", views_by_method<RealArrays>([](const MethodResult& method) -> auto& {
                     return method.solution.amplitudes;
                   }),
                   "By method, of every channel, 0 to 1.")
      .def_prop_ro(
          "drives",
          [](const SharedRun& self) {
            return ComplexArrays(
                by_method(*self, [](const MethodResult& method) { return owned(drive(method.solution)); }));
          },
          "By method, amplitude exp(i phase) of every channel.")
      .def_prop_ro("evaluation_pressures", views_by_method<ComplexArrays>([](const MethodResult& method) -> auto& {
                     return method.evaluation_pressure;
                   }),
                   "By method, on the evaluation mesh [Pa]; empty if `pressures` are evaluated.")
      .def_prop_ro(
          "radiation",
          views_by_method<RealArrays>([](const MethodResult& method) -> auto& { return method.radiation; }),
          "By method, the radiation pressure on every face of `evaluation_mesh`, or of `mesh` if there is none "
          "[Pa]: > 0 pushes inwards. Empty without metrics.")
      .def_prop_ro(
          "problems",
          [](const SharedRun& self) {
            nb::dict problems;
            for (const RunTransfer& transfer : self->transfers) {
              problems[transfer.scheme.c_str()] = part_of(self, transfer.problem);
            }
            return ProblemsByName(problems);
          },
          "By scheme a `Problem`, if the scene's `write` has transfer.");
}

/// What else it holds.
void add_records(nb::class_<SharedRun>& run) {
  run.def_prop_ro(
         "fields", [](nb::handle_t<SharedRun> self) { return grids(nb::cast<const SharedRun&>(self), self); },
         "By name of the grid and method [Pa], axes z, y, x; `points`: the positions, with a last axis x, y, z [m].")
      .def_prop_ro(
          "levels", [](const SharedRun& self) { return Rows(object_of(levels_value(*self)["sound_levels"])); },
          "Of every point among the fields and method a dict: point, method, amplitude_pa (peak), level_db (re 20 uPa, "
          "rms).")
      .def_prop_ro(
          "exposure_limits",
          [](const SharedRun& self) { return Rows(object_of(levels_value(*self)["exposure_limits"])); },
          "Published for the frequency, if there are points, as dicts: source, for, limit_db. No assessment of safety.")
      .def_prop_ro(
          "seconds", [](const SharedRun& self) { return numbers_dict(self->seconds); }, "By stage [s].")
      .def_prop_ro("provenance", &provenance, "Program, machine, threads and time.");
}

void add_functions(nb::class_<SharedRun>& run) {
  run.def("field", &field_at, nb::arg("points"), nb::arg("threads") = nb::none(), nb::arg("wave") = nb::none(),
          R"(The pressure off the skin.

Parameters
----------
points : array_like, shape (J, 3)
    [m]
threads : int, optional
wave : Wave, optional
    Another than that of the run, whose pressures on the skin stay.

Returns
-------
dict of str to numpy.ndarray of complex, shape (J,)
    By method [Pa]: 0 inside the body, NaN on a transducer.

Examples
--------
>>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
>>> run.field([[0, 0, 0.05]])["focus"].shape
(1,)
)")
      .def("save", &save, nb::arg("path"), nb::arg("force") = false,
           R"(Writes one file if the name ends in .h5, otherwise a folder with the files that the scene's `write` lists.

Parameters
----------
path : str or os.PathLike
force : bool
    Whether an older run is replaced.

Examples
--------
>>> tf.run("capsule", set={"solve.methods": ["focus"]}).save("quick.h5", force=True)
)")
      .def("picture", &picture_of, nb::arg("picture") = nb::none(), R"(A picture of the program.

Parameters
----------
picture : str, optional
    overview or field_GRID; default: overview.

Examples
--------
>>> png = bytes(tf.run("capsule", set={"solve.methods": ["focus"]}).picture())
)")
      .def("_repr_png_", [](const SharedRun& self) { return bytes_of(picture_of(self, std::nullopt)); })
      .def("__repr__", [](const SharedRun& self) { return methods_table(*self); });
}

}  // namespace

nb::object named(nb::handle values) { return nb::module_::import_("touchfield._plain").attr("named")(values); }

Numbers numbers_dict(const std::vector<std::pair<std::string, double>>& values) {
  nb::dict dict;
  for (const auto& [name, value] : values) {
    dict[name.c_str()] = value;
  }
  return named(dict);
}

void add_runs(nb::module_& module) {
  add_picture(module);
  nb::class_<SharedRun> kind(module, "Run", "The results of a scene. Arrays are read-only views of them.");
  add_results(kind, "The skin, a `Mesh`.");
  add_inputs(kind);
  add_methods(kind);
  add_records(kind);
  add_functions(kind);
  nb::dict units;  // of metrics
  for (const MetricField& field : metric_fields()) {
    units[field.name] = field.share ? "%" : field.unit;
  }
  module.attr("_metric_units") = units;
  module.def(
      "scenes",
      [] {
        std::vector<std::string> names;
        std::ranges::transform(shipped_scenes(), std::back_inserter(names),
                               [](const ShippedScene& scene) { return std::string(scene.name); });
        return names;
      },
      R"(Names of the scenes that come with the package; `run` and others take them in place of a file.

Examples
--------
>>> "quick" in tf.scenes()
True
)");
  module.def(
      "scene",
      [](const std::string& name) {
        const ShippedScene* shipped = shipped_scene(name);
        require(shipped != nullptr, "{}: no scene that comes with the package; scenes() lists them", name);
        return std::string(shipped->text);
      },
      nb::arg("name"), R"(The YAML text of a scene that comes with the package, to change or to save.

Parameters
----------
name : str
    One of `scenes()`.

Examples
--------
>>> run = tf.run(tf.scene("quick").replace("pressure_pa: 4000", "pressure_pa: 3000"))
)");
  module.def("_run", &run, nb::arg("scene"), nb::arg("set") = nb::none(), nb::arg("device") = nb::none(),
             nb::arg("threads") = nb::none(), nb::arg("own") = nb::none());
  module.def(
      "read_run",
      [](const PathLike& path) {
        return computed(0, [file = path_of(path)](Progress& progress) {
          return shared(read_run_file(run_file_at(file), [&](const std::string& text) { progress.warn(text); }));
        });
      },
      nb::arg("path"), R"(Reads a run.h5, or the folder that contains it.

Parameters
----------
path : str or os.PathLike

Raises
------
InputError
    If the file is missing, damaged or no run.

Examples
--------
>>> tf.run("capsule", set={"solve.methods": ["focus"]}).save("quick.h5", force=True)
>>> run = tf.read_run("quick.h5")
)");
}

}  // namespace touchfield::python
