#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/jobs/run_model.h"
#include "sim/pictures/figures.h"
#include "sim/run/check.h"
#include "sim/run/evaluate_methods.h"
#include "sim/run/run_data.h"
#include "sim/run/run_file.h"
#include "sim/run/run_text.h"
#include "sim/run/scan_comparison.h"
#include "sim/scene/scene_reader.h"

namespace touchfield::python {

namespace {

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

SharedRun run(nb::handle scene, nb::handle set, const std::optional<std::string>& device, std::optional<int> threads,
              nb::handle own) {
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

void save(const SharedRun& run, nb::handle path, bool force) {
  do_work(0, [run, place = path_of(path), force](Progress& progress) {
    if (!place.ends_with(".h5")) {
      filled(written_job(*run, scene_of(*run)), place, force, progress);
    } else if (!force && std::filesystem::exists(place)) {
      throw InputError(fmt::format("{}: the file exists; force=True replaces it", place));
    } else {
      write_run_file(place, *run);
    }
  });
}

void save_picture(const Picture& picture, nb::handle path) {
  const std::string place = path_of(path);
  if (!place.ends_with(".png")) {
    throw InputError(fmt::format("{}: the name of a picture must end in .png", place));
  }
  write_atomically(place, {picture.bytes});
}

Picture plot(const SharedRun& run, const std::optional<std::string>& picture) {
  const std::string first = run->methods.empty() ? "setup" : "pressure_" + run->methods.front().name;
  return computed(0, [run, name = picture.value_or(first)](Progress&) {
    return Picture{draw_figure(name, *run, PictureFormat::kPng)};
  });
}

/// A dict of what `value` makes of every method.
template <typename Value>
nb::dict by_method(const SharedRun& run, Value value) {
  nb::dict values;
  for (const MethodResult& method : run->methods) {
    values[method.name.c_str()] = value(method);
  }
  return values;
}

/// The same of something in a run that is looked at.
template <typename Member>
auto views_by_method(Member member) {
  return [member](nb::handle_t<SharedRun> self) {
    return by_method(nb::cast<const SharedRun&>(self),
                     [&](const MethodResult& method) { return view(member(method), self); });
  };
}

Wave wave_of(const Run& run) {
  const Scene scene = scene_of(run);
  return {build_medium(scene.medium, scene.frequency), scene.frequency};
}

nb::dict field_at(const SharedRun& run, nb::handle points, std::optional<int> threads,
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

nb::dict provenance(const SharedRun& run) {
  nb::dict values;
  for (const ProvenanceField& field : provenance_fields()) {
    values[field.name] = run->provenance.*field.value;
  }
  values["threads"] = run->provenance.threads;
  return values;
}

/// A grid's values in the order of its axes, z first.
nb::dict grids(const SharedRun& run, nb::handle self) {
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

void add_picture(nb::module_& module) {
  nb::class_<Picture>(module, "Picture", "A picture made by the program; Jupyter displays it.")
      .def("_repr_png_", [](const Picture& self) { return nb::bytes(self.bytes.data(), self.bytes.size()); })
      .def("__bytes__", [](const Picture& self) { return nb::bytes(self.bytes.data(), self.bytes.size()); })
      .def("save", &save_picture, nb::arg("path"), nb::sig("def save(self, path: str | os.PathLike) -> None"),
           "Writes it as PNG.");
}

void add_methods(nb::class_<SharedRun>& run) {
  run.def_prop_ro("name", [](const SharedRun& self) { return self->name; })
      .def_prop_ro(
          "scene", [](const SharedRun& self) { return self->scene; }, "The scene as YAML with all defaults.")
      .def_prop_ro("mesh", [](const SharedRun& self) { return SkinMesh{part_of(self, self->mesh)}; })
      .def_prop_ro("array", [](const SharedRun& self) { return part_of(self, self->array); })
      .def_prop_ro("target",
                   [](const SharedRun& self) -> std::optional<SharedTarget> {
                     return self->target ? std::optional(part_of(self, *self->target)) : std::nullopt;
                   })
      .def_prop_ro("methods",
                   [](const SharedRun& self) {
                     std::vector<std::string> names;
                     for (const MethodResult& method : self->methods) {
                       names.push_back(method.name);
                     }
                     return names;
                   })
      .def_prop_ro(
          "metrics",
          [](const SharedRun& self) {
            return by_method(self, [](const MethodResult& method) { return metrics_dict(method.metrics); });
          },
          nb::sig("def metrics(self) -> dict[str, dict[str, float]]"))
      .def_prop_ro(
          "status",
          [](const SharedRun& self) {
            return by_method(self, [](const MethodResult& method) { return to_string(method.solution.status); });
          },
          nb::sig("def status(self) -> dict[str, str]"))
      .def_prop_ro("pressures", views_by_method([](const MethodResult& method) -> auto& { return method.pressure; }),
                   nb::sig("def pressures(self) -> dict[str, numpy.typing.NDArray[numpy.complex128]]"),
                   "By method, on every face [Pa].")
      .def_prop_ro("phases",
                   views_by_method([](const MethodResult& method) -> auto& { return method.solution.phases; }),
                   nb::sig("def phases(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]"),
                   "By method, of every channel [rad].")
      .def_prop_ro("amplitudes",
                   views_by_method([](const MethodResult& method) -> auto& { return method.solution.amplitudes; }),
                   nb::sig("def amplitudes(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]"),
                   "By method, of every channel, 0 to 1.");
}

void add_evaluation(nb::class_<SharedRun>& run) {
  run.def_prop_ro("evaluation", [](const SharedRun& self) { return self->evaluation; })
      .def_prop_ro(
          "solved_skin", [](const SharedRun& self) { return to_string(self->solved_skin); },
          "Extent of the skin in `mesh` and `pressures`: 'whole', or 'part' (within keep_within_mm).")
      .def_prop_ro("evaluation_mesh",
                   [](const SharedRun& self) -> std::optional<SkinMesh> {
                     return self->evaluation_model
                                ? std::optional(SkinMesh{part_of(self, self->evaluation_model->mesh)})
                                : std::nullopt;
                   })
      .def_prop_ro("evaluation_pressures",
                   views_by_method([](const MethodResult& method) -> auto& { return method.evaluation_pressure; }),
                   nb::sig("def evaluation_pressures(self) -> dict[str, numpy.typing.NDArray[numpy.complex128]]"),
                   "By method, on the evaluation mesh [Pa]; empty if `pressures` are evaluated.")
      .def_prop_ro(
          "problems",
          [](const SharedRun& self) {
            nb::dict problems;
            for (const RunTransfer& transfer : self->transfers) {
              problems[transfer.scheme.c_str()] = part_of(self, transfer.problem);
            }
            return problems;
          },
          nb::sig("def problems(self) -> dict[str, Problem]"), "By scheme, if the scene's `write` has transfer.")
      .def_prop_ro(
          "fields", [](nb::handle_t<SharedRun> self) { return grids(nb::cast<const SharedRun&>(self), self); },
          nb::sig("def fields(self) -> dict[str, dict[str, numpy.typing.NDArray[typing.Any]]]"),
          "By name of the grid and method [Pa], axes z, y, x; `points`: the positions, with a last axis x, y, z [m].")
      .def_prop_ro(
          "levels", [](const SharedRun& self) { return object_of(levels_value(*self)["sound_levels"]); },
          nb::sig("def levels(self) -> list[dict[str, typing.Any]]"),
          "Of every point among the fields and method: point, method, amplitude_pa (peak), level_db (re 20 uPa, rms).")
      .def_prop_ro(
          "exposure_limits", [](const SharedRun& self) { return object_of(levels_value(*self)["exposure_limits"]); },
          nb::sig("def exposure_limits(self) -> list[dict[str, typing.Any]]"),
          "Published for the frequency, if there are points: source, for, limit_db. No assessment of safety.")
      .def_prop_ro(
          "seconds", [](const SharedRun& self) { return numbers_dict(self->seconds); },
          nb::sig("def seconds(self) -> dict[str, float]"))
      .def_prop_ro("warnings", [](const SharedRun& self) { return self->warnings; })
      .def_prop_ro("notes", [](const SharedRun& self) { return self->notes; })
      .def_prop_ro("provenance", &provenance, nb::sig("def provenance(self) -> dict[str, typing.Any]"))
      .def_prop_ro(
          "wave", [](const SharedRun& self) { return wave_of(*self); }, nb::sig("def wave(self) -> Wave"))
      .def(
          "clear",
          [](const SharedRun& self, nb::handle points) {
            return clear_points(*self, point_rows(points, "Run.clear: points"));
          },
          nb::arg("points"), nb::sig("def clear(self, points: numpy.typing.ArrayLike) -> list[bool]"),
          "Whether points lie off the body, no nearer to its skin than the longest edge of the face there.")
      .def("field", &field_at, nb::arg("points"), nb::arg("threads") = nb::none(), nb::arg("wave") = nb::none(),
           nb::sig(
               "def field(self, points: numpy.typing.ArrayLike, threads: int | None = None, wave: Wave | None = None) "
               "-> dict[str, numpy.typing.NDArray[numpy.complex128]]"),
           "By method, the pressure at points off the skin [Pa]: 0 inside the body, NaN on a transducer.")
      .def("save", &save, nb::arg("path"), nb::arg("force") = false,
           nb::sig("def save(self, path: str | os.PathLike, force: bool = False) -> None"),
           "Writes one file if the name ends in .h5, otherwise a folder with the files that the scene's `write` lists.")
      .def("plot", &plot, nb::arg("picture") = nb::none(),
           "A picture by its name: setup, target, pressure_METHOD, field_GRID_METHOD; default: the pressure of the "
           "first method.")
      .def("_repr_png_",
           [](const SharedRun& self) {
             const Picture drawn = plot(self, std::nullopt);
             return nb::bytes(drawn.bytes.data(), drawn.bytes.size());
           })
      .def("__repr__", [](const SharedRun& self) { return methods_table(*self); });
}

void add_run(nb::module_& module) {
  nb::class_<SharedRun> run(module, "Run", "The results of a scene. Arrays are read-only views of them.");
  add_methods(run);
  add_evaluation(run);
}

}  // namespace

nb::dict numbers_dict(const std::vector<std::pair<std::string, double>>& values) {
  nb::dict dict;
  for (const auto& [name, value] : values) {
    dict[name.c_str()] = value;
  }
  return dict;
}

void add_runs(nb::module_& module) {
  add_picture(module);
  add_run(module);
  module.def("run", &run, nb::arg("scene"), nb::arg("set") = nb::none(), nb::arg("device") = nb::none(),
             nb::arg("threads") = nb::none(), nb::arg("own") = nb::none(),
             nb::sig("def run(scene: str | os.PathLike | tuple[str, str] | Model, set: dict[str, typing.Any] | None = "
                     "None, device: str | None = "
                     "None, threads: int | None = None, own: dict[str, numpy.typing.ArrayLike] | None = None) -> Run"),
             "Computes a scene, as `touchfield run`. `own` adds methods of your own: their names, and phases or "
             "complex drives. "
             "Writes nothing.");
  module.def(
      "read_run",
      [](nb::handle path) {
        return computed(0, [file = path_of(path)](Progress& progress) {
          return shared(read_run_file(run_file_at(file), [&](const std::string& text) { progress.warn(text); }));
        });
      },
      nb::arg("path"), nb::sig("def read_run(path: str | os.PathLike) -> Run"),
      "Reads a run.h5, or the folder that holds it.");
}

}  // namespace touchfield::python
