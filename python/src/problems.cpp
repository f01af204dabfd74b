#include <cmath>
#include <map>
#include <nanobind/stl/map.h>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/field/evaluate.h"
#include "sim/field/metrics.h"
#include "sim/field/skin_problems.h"
#include "sim/mesh/query/clearance.h"
#include "sim/mesh/query/inspect.h"
#include "sim/model/clear_transducers.h"
#include "sim/run/methods.h"
#include "sim/run/skin_scattering.h"
#include "sim/run/solve_model.h"
#include "solvers/phase/optimality_bound.h"
#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"

namespace touchfield::python {

namespace {

Wave wave_or_default(const std::optional<Wave>& wave) {
  return wave ? *wave : Wave(build_medium({}, Scene{}.frequency), Scene{}.frequency);
}

Scheme scheme_of_name(const char* who, const std::string& name) {
  std::string names;
  for (const Scheme scheme : all_schemes()) {
    if (to_string(scheme) == name) {
      return scheme;
    }
    names += (names.empty() ? "" : ", ") + to_string(scheme);
  }
  throw InputError(fmt::format("{}: scheme = '{}' must be one of {}", who, name, names));
}

SolverSpec solver_spec(const char* who, const std::optional<std::string>& device) {
  SolverSpec spec;
  if (device) {
    const std::optional<ComputeDevice> chosen = compute_device(*device);
    if (!chosen) {
      throw InputError(fmt::format("{}: device = '{}' must be auto, cpu, cuda or cuda:N", who, *device));
    }
    spec.device = *chosen;
  }
  return spec;
}

/// What a scene's body and array have to be, too.
void require_scatterer(const TriangleMesh& mesh, const TransducerArray& array, const char* who) {
  require_closed_surface(mesh, fmt::format("{}: mesh", who));
  if (array.kind == TransducerArray::Kind::kPlaneWave || lies_apart(array, mesh, kLeastClearance)) {
    return;
  }
  const std::vector<PointClearance> clearances = point_clearances(mesh, array.positions);
  for (std::size_t n = 0; n < clearances.size(); ++n) {
    if (clearances[n].inside || clearances[n].distance < kLeastClearance) {
      throw InputError(
          fmt::format("{}: transducer {} is {} the body, {:.3g} m from its skin; it must be outside, {:g} m "
                      "or more from it",
                      who, n, clearances[n].inside ? "inside" : "outside", clearances[n].distance, kLeastClearance));
    }
  }
}

nb::object transfer(const SkinMesh& skin, const SharedArray& array, const std::optional<Wave>& wave, nb::handle faces,
                    const std::string& scheme, const std::optional<std::string>& device, std::optional<int> threads) {
  const SolverSpec spec = solver_spec("transfer", device);
  const int count = thread_count(threads);
  const auto mesh = skin.mesh;
  const Wave sound = wave_or_default(wave);
  const Scheme chosen = scheme_of_name("transfer", scheme);
  if (faces.is_none()) {
    return owned(computed(count, [=](Progress& progress) {
      require_scatterer(*mesh, *array, "transfer");
      return transfer_matrix(*mesh, sound, *array, chosen, spec, progress);
    }));
  }
  const auto rows = index_list(faces, "transfer: faces", mesh->face_count());
  return owned(computed(count, [=](Progress& progress) {
    require_scatterer(*mesh, *array, "transfer");
    std::vector<SolveRecord> records;
    SkinScattering scattering(*mesh, sound, chosen, spec, *array, records, progress,
                              static_cast<Eigen::Index>(rows.size()));
    return scattering.transfer_rows(rows, "transfer");
  }));
}

/// Asks the solver of a model's methods by a scheme.
template <typename Ask>
auto asked(const Model& model, Scheme scheme, Progress& progress, Ask ask) {
  if (!model.posture.target) {
    throw InputError(fmt::format("scene {}: it has no target, which the phase methods need", model.fixed->scene.name));
  }
  std::vector<SolveRecord> records;
  const auto scattering = make_scattering("python", model.body.mesh, scheme, model.fixed->scene.solve.solver,
                                          largest_block(model.fixed->scene, scheme, model.fixed->array.size(), false),
                                          model, model.fixed->array.response, nullptr, records, progress);
  const Target target = build_target(model);
  MethodSolver solver(*scattering, model.fixed->array.size(), target, model.fixed->scene.solve, outside_skin(model));
  return ask(solver, target.amplitudes);
}

SharedProblem problem_of_model(const SharedModel& model, std::optional<int> threads) {
  return computed(thread_count(threads), [model](Progress& progress) {
    return asked(*model, model->fixed->scene.solve.scheme, progress,
                 [&](MethodSolver& solver, const Eigen::VectorXd& wanted) {
                   RunTransfer transfer = solver.run_transfer(wanted, progress);
                   transfer.problem.device.reset();  // of a card, which is let go of
                   return shared(std::move(transfer.problem));
                 });
  });
}

SharedProblem problem_of(nb::handle target, nb::handle amplitudes, nb::handle weights, nb::handle outside) {
  SkinProblem problem;
  problem.target = complex_table(target, "Problem: target");
  problem.amplitudes = real_list(amplitudes, "Problem: amplitudes");
  problem.weights = real_list(weights, "Problem: weights");
  problem.outside =
      outside.is_none() ? Eigen::MatrixXcd(0, problem.target.cols()) : complex_table(outside, "Problem: outside");
  require_valid(problem, "Problem");
  return shared(std::move(problem));
}

SharedProblem problem_of_transfer(nb::handle h, const SkinMesh& skin, const SharedTarget& target, double outside_weight,
                                  std::optional<int> threads) {
  constexpr double kTolerance = 1e-4;  // as make_transfer
  const Eigen::MatrixXcd rows = complex_table(h, "Problem.of_transfer: h");
  require_count("Problem.of_transfer: h", rows.rows(), skin.mesh->face_count(), "per face");
  if (!(outside_weight >= 0 && std::isfinite(outside_weight))) {
    throw InputError(fmt::format("Problem.of_transfer: outside_weight = {:g} must be >= 0", outside_weight));
  }
  Eigen::VectorXd outside;
  if (outside_weight > 0) {
    outside = outside_weight * skin.mesh->areas();
    outside(target->faces).setZero();
  }
  return computed(thread_count(threads), [=, mesh = skin.mesh](Progress&) {
    const Eigen::MatrixXcd each = Eigen::MatrixXcd::Identity(rows.cols(), rows.cols());
    return shared(reduced_skin_problem(rows, each, mesh->areas(), *target, outside, kTolerance).problem);
  });
}

void require_steps(std::string_view who, int iterations) {
  if (iterations < 1) {
    throw InputError(fmt::format("{}: iterations = {} must be >= 1", who, iterations));
  }
}

/// Drives to start from by name, or as they are: one column; none where the method finds its own.
Eigen::MatrixXcd start_of(nb::handle start, const SharedProblem& problem, const PhaseMethod& method) {
  const Eigen::Index channels = problem->channel_count();
  const std::string what = fmt::format("{}: start", method.name);
  if (start.is_none()) {
    return method.searches ? Eigen::MatrixXcd(channels, 0) : Eigen::MatrixXcd::Ones(channels, 1);
  }
  if (!nb::isinstance<nb::str>(start)) {
    const Eigen::VectorXcd given = complex_list(start, what);
    require_count(what, given.size(), channels, "per channel");
    return given;
  }
  const auto name = nb::cast<std::string>(start);
  if (name == "adjoint") {
    return adjoint_start(*problem);
  }
  if (name == "spectral") {
    return spectral_start(*problem);
  }
  if (name == "zero") {
    return Eigen::MatrixXcd::Ones(channels, 1);
  }
  throw InputError(fmt::format("{} = '{}' must be adjoint, spectral, zero or a drive vector", what, name));
}

ChannelTolerances tolerances_of(const std::map<std::string, double>& given) {
  ChannelTolerances tolerances;
  for (const auto& [name, value] : given) {
    double* member = name == "phase"  ? &tolerances.phase
                     : name == "gain" ? &tolerances.gain
                     : name == "dead" ? &tolerances.dead
                                      : nullptr;
    require(member != nullptr, "tolerances: '{}' must be phase, gain or dead", name);
    require(value >= 0 && std::isfinite(value) && (name != "dead" || value < 1), "tolerances: {} = {:g} must be >= 0{}",
            name, value, name == "dead" ? " and below 1" : "");
    *member = value;
  }
  return tolerances;
}

SharedSolution solve_on_skin(const std::string& name, const SharedProblem& problem, int iterations, nb::handle start,
                             bool free_amplitudes, bool free_level, const std::map<std::string, double>& tolerances,
                             std::optional<int> threads) {
  const PhaseMethod& method = phase_method(name);
  if (method.solve == nullptr) {
    throw InputError(fmt::format("{}: it does not work on a Problem", name));
  }
  require_steps(method.name, iterations);
  const MethodSettings settings{.iterations = iterations,
                                .free_amplitudes = free_amplitudes,
                                .free_level = free_level,
                                .tolerances = tolerances_of(tolerances),
                                .search = method.searches && start.is_none()};
  const Eigen::MatrixXcd starts = start_of(start, problem, method);
  return computed(thread_count(threads), [=, &method](Progress& progress) {
    progress.begin(method.name);
    return shared(method.solve(*problem, starts, settings,
                               [&](int done, double) { progress.advance(static_cast<double>(done) / iterations); }));
  });
}

/// Phase conjugation: every channel arrives in phase where a row of H is from.
SharedSolution focus_of_row(nb::handle row) { return shared(full_drive(-complex_list(row, "focus: row").cwiseArg())); }

SharedSolution solve_by_paper(const SharedModel& model, int iterations, const std::string& faces, bool scattered,
                              std::optional<int> threads) {
  require_steps("solve_paper", iterations);
  if (faces != "equal" && faces != "area") {
    throw InputError(fmt::format("solve_paper: faces = '{}' must be equal or area", faces));
  }
  MethodSpec method;
  method.kind = &phase_method(scattered ? "paper" : "unscattered");
  method.name = method.kind->name;
  method.scheme = model->fixed->scene.solve.scheme;
  method.iterations = iterations;
  method.faces = faces == "area" ? FaceWeights::kArea : FaceWeights::kEqual;
  return computed(thread_count(threads), [=](Progress& progress) {
    return asked(*model, method.scheme, progress, [&](MethodSolver& solver, const Eigen::VectorXd& wanted) {
      return shared(solver.solve(method, wanted, progress));
    });
  });
}

/// Pressures on the faces of a body for one drive or several, without H.
nb::object scatter(const SkinMesh& skin, const SharedArray& array, nb::handle drives, const std::optional<Wave>& wave,
                   const std::string& scheme, const std::optional<std::string>& device, std::optional<int> threads) {
  const SolverSpec spec = solver_spec("scatter", device);
  const Scheme chosen = scheme_of_name("scatter", scheme);
  const Eigen::MatrixXcd q = drive_columns(drives, "scatter: drives", array->size());
  const auto mesh = skin.mesh;
  return owned(computed(thread_count(threads), [=, sound = wave_or_default(wave)](Progress& progress) {
    require_scatterer(*mesh, *array, "scatter");
    std::vector<SolveRecord> records;
    SkinScattering scattering(*mesh, sound, chosen, spec, *array, records, progress, q.cols());
    Eigen::MatrixXcd pressure = scattering.pressure(q, "scatter");
    require_finite("scatter", pressure);
    return pressure;
  }));
}

nb::object radiation(const SkinMesh& skin, nb::handle pressure, const std::optional<Wave>& wave) {
  const Eigen::VectorXcd p = complex_list(pressure, "force: pressure");
  require_count("force: pressure", p.size(), skin.mesh->face_count(), "per face");
  return owned(computed(0, [=, mesh = skin.mesh, sound = wave_or_default(wave)](Progress&) {
    return radiation_pressure(SurfaceGradient(*mesh, sound.k()), sound, p);
  }));
}

nb::dict bound_of(const SharedProblem& problem, std::optional<int> threads) {
  const OptimalityBound found = computed(thread_count(threads), [problem](Progress&) { return prove_bound(*problem); });
  nb::dict values;
  values["bound"] = found.bound;
  values["relaxed"] = found.relaxed;
  values["iterations"] = found.iterations;
  values["converged"] = found.converged;
  return values;
}

nb::dict evaluate_phases(const SharedModel& model, nb::handle phases, std::optional<int> threads) {
  const OwnMethod given = own_method("given", phases, "evaluate: phases");
  const Metrics metrics = computed(thread_count(threads), [model, given](Progress& progress) {
    FixedModel fixed = *model->fixed;
    fixed.scene.solve.methods.clear();
    fixed.scene.solve.optimality_bound = false;
    fixed.scene.write.transfer = false;
    fixed.fields.clear();
    Model alone = *model;
    alone.fixed = std::make_shared<const FixedModel>(std::move(fixed));
    return solve_model(
               with_own(alone, {given}), {}, [](const Run&) {}, progress)
        .methods.front()
        .metrics;
  });
  return metrics_dict(metrics);
}

nb::object field(const SkinMesh& skin, const SharedArray& array, nb::handle pressure, nb::handle drives,
                 nb::handle points, const std::optional<Wave>& wave, std::optional<int> threads) {
  const Eigen::VectorXcd p = complex_list(pressure, "field: pressure");
  const Eigen::VectorXcd q = complex_list(drives, "field: drives");
  const Points at = point_rows(points, "field: points");
  const auto mesh = skin.mesh;
  require_count("field: pressure", p.size(), mesh->face_count(), "per face");
  require_count("field: drives", q.size(), array->size(), "per channel");
  const Wave sound = wave_or_default(wave);
  return owned(computed(thread_count(threads), [=](Progress&) {
    require_scatterer(*mesh, *array, "field");
    return Eigen::VectorXcd(evaluate_field(*mesh, *array, sound, at, p, q).pressure.col(0));
  }));
}

double cost(const SharedProblem& problem, nb::handle drives) {
  const Eigen::VectorXcd q = complex_list(drives, "cost: drives");
  require_count("cost: drives", q.size(), problem->channel_count(), "per channel");
  return skin_cost(*problem, q);
}

void add_classes(nb::module_& module) {
  nb::class_<SharedProblem>(module, "Problem",
                            "sum_j w_j (|h_j q| - p'_j)^2 + |R q|^2, the misfit of a drive vector q on the skin, "
                            "which method `surface` minimises.")
      .def(
          "__init__",
          [](SharedProblem* self, nb::handle target, nb::handle amplitudes, nb::handle weights, nb::handle outside) {
            new (self) SharedProblem(problem_of(target, amplitudes, weights, outside));
          },
          nb::arg("target"), nb::arg("amplitudes"), nb::arg("weights"), nb::arg("outside") = nb::none(),
          nb::sig("def __init__(self, target: numpy.typing.ArrayLike, amplitudes: numpy.typing.ArrayLike, weights: "
                  "numpy.typing.ArrayLike, outside: numpy.typing.ArrayLike | None = None) -> None"),
          "target: the K x N rows of H; amplitudes: p', K [Pa]; weights: w, K, areas [m2]; outside: R, r x N.")
      .def_static("of_model", &problem_of_model, nb::arg("model"), nb::arg("threads") = nb::none(),
                  "The problem of a scene's methods, with the skin outside the target reduced to a few rows.")
      .def_static(
          "of_transfer", &problem_of_transfer, nb::arg("h"), nb::arg("mesh"), nb::arg("target"),
          nb::arg("outside_weight"), nb::arg("threads") = nb::none(),
          nb::sig("def of_transfer(h: numpy.typing.ArrayLike, mesh: Mesh, target: Target, outside_weight: float, "
                  "threads: int | None = None) -> Problem"),
          "The problem of H of every face, with the skin outside the target reduced to a few rows.")
      .def_prop_ro("target", part_of<SharedProblem>(&SkinProblem::target))
      .def_prop_ro("amplitudes", part_of<SharedProblem>(&SkinProblem::amplitudes))
      .def_prop_ro("weights", part_of<SharedProblem>(&SkinProblem::weights))
      .def_prop_ro("outside", part_of<SharedProblem>(&SkinProblem::outside))
      .def(
          "__getstate__",
          [](const SharedProblem& self) {
            return nb::make_tuple(owned(self->target), owned(self->amplitudes), owned(self->weights),
                                  owned(self->outside));
          },
          nb::sig("def __getstate__(self) -> tuple[typing.Any, ...]"))
      .def(
          "__setstate__",
          [](SharedProblem& self, const nb::tuple& state) {
            new (&self) SharedProblem(problem_of(state[0], state[1], state[2], state[3]));
          },
          nb::sig("def __setstate__(self, state: tuple[typing.Any, ...]) -> None"))
      .def("cost", &cost, nb::arg("drives"), nb::sig("def cost(self, drives: numpy.typing.ArrayLike) -> float"))
      .def("__repr__", [](const SharedProblem& self) {
        return fmt::format("<touchfield.Problem: {} faces, {} channels, {} outside rows>", self->target_count(),
                           self->channel_count(), self->outside.rows());
      });
  nb::class_<SharedSolution>(module, "Solution", "The drive vector that a phase method found.")
      .def_prop_ro("phases", part_of<SharedSolution>(&PhaseSolution::phases))
      .def_prop_ro("amplitudes", part_of<SharedSolution>(&PhaseSolution::amplitudes))
      .def_prop_ro(
          "drives", [](const SharedSolution& self) { return owned(drive(*self)); },
          nb::sig("def drives(self) -> numpy.typing.NDArray[numpy.complex128]"))
      .def_prop_ro("cost_history", part_of<SharedSolution>(&PhaseSolution::cost_history))
      .def_prop_ro("iterations", [](const SharedSolution& self) { return self->iterations; })
      .def_prop_ro("status", [](const SharedSolution& self) { return to_string(self->status); })
      .def("__repr__", [](const SharedSolution& self) {
        return fmt::format("<touchfield.Solution: {} channels, {} after {} iterations>", self->phases.size(),
                           to_string(self->status), self->iterations);
      });
}

}  // namespace

void add_problems(nb::module_& module) {
  add_classes(module);
  module.def(
      "transfer", &transfer, nb::arg("mesh"), nb::arg("array"), nb::arg("wave") = nb::none(), nb::kw_only(),
      nb::arg("faces") = nb::none(), nb::arg("scheme") = to_string(kDefaultScheme), nb::arg("device") = nb::none(),
      nb::arg("threads") = nb::none(),
      nb::sig("def transfer(mesh: Mesh, array: Array, wave: Wave | None = None, *, faces: numpy.typing.ArrayLike | "
              "None = None, scheme: str = ..., device: str | None = None, threads: int | None = None) -> "
              "numpy.typing.NDArray[numpy.complex128]"),
      "H: the pressure of each channel at full drive on each face, or on the given faces [Pa]. The mesh must be "
      "closed.");
  module.def(
      "solve", &solve_on_skin, nb::arg("method"), nb::arg("problem"), nb::kw_only(),
      nb::arg("iterations") = kUsualIterations, nb::arg("start") = nb::none(),
      nb::arg("free_amplitudes") = MethodSettings{}.free_amplitudes,
      nb::arg("free_level") = MethodSettings{}.free_level, nb::arg("tolerances") = nb::dict(),
      nb::arg("threads") = nb::none(),
      nb::sig(
          "def solve(method: str, problem: Problem, *, iterations: int = ..., start: str | numpy.typing.ArrayLike | "
          "None = None, free_amplitudes: bool = ..., free_level: bool = ..., tolerances: dict[str, float] = ..., "
          "threads: int | None = None) -> Solution"),
      "A phase method that works on rows of H, by its name in scenes.");
  module.def("focus", &focus_of_row, nb::arg("row"), nb::sig("def focus(row: numpy.typing.ArrayLike) -> Solution"),
             "Phases with which the sound of all channels arrives in phase, by the row of H of that place.");
  module.def(
      "scatter", &scatter, nb::arg("mesh"), nb::arg("array"), nb::arg("drives"), nb::arg("wave") = nb::none(),
      nb::kw_only(), nb::arg("scheme") = to_string(kDefaultScheme), nb::arg("device") = nb::none(),
      nb::arg("threads") = nb::none(),
      nb::sig("def scatter(mesh: Mesh, array: Array, drives: numpy.typing.ArrayLike, wave: Wave | None = None, *, "
              "scheme: str = ..., device: str | None = None, threads: int | None = None) -> "
              "numpy.typing.NDArray[numpy.complex128]"),
      "The pressure of drives on every face [Pa], N or N x S.");
  module.def(
      "radiation_pressure", &radiation, nb::arg("mesh"), nb::arg("pressure"), nb::arg("wave") = nb::none(),
      nb::sig("def radiation_pressure(mesh: Mesh, pressure: numpy.typing.ArrayLike, wave: Wave | None = None) -> "
              "numpy.typing.NDArray[numpy.float64]"),
      "The time-averaged radiation pressure on every face, inwards [Pa].");
  module.def("solve_paper", &solve_by_paper, nb::arg("model"), nb::kw_only(), nb::arg("iterations") = kUsualIterations,
             nb::arg("faces") = "equal", nb::arg("scattered") = true, nb::arg("threads") = nb::none(),
             "Method `paper` or `unscattered` on the model of a scene.");
  module.def("optimality_bound", &bound_of, nb::arg("problem"), nb::arg("threads") = nb::none(),
             nb::sig("def optimality_bound(problem: Problem, threads: int | None = None) -> dict[str, typing.Any]"),
             "The optimality bound: a proved lower bound of the problem's cost over all drive vectors [Pa2 m2].");
  module.def("evaluate", &evaluate_phases, nb::arg("model"), nb::arg("phases"), nb::arg("threads") = nb::none(),
             nb::sig("def evaluate(model: Model, phases: numpy.typing.ArrayLike, threads: int | None = None) -> "
                     "dict[str, float]"),
             "The metrics of phases at full drive on the scene's evaluation mesh, as for a built-in method.");
  module.def(
      "field", &field, nb::arg("mesh"), nb::arg("array"), nb::arg("pressure"), nb::arg("drives"), nb::arg("points"),
      nb::arg("wave") = nb::none(), nb::arg("threads") = nb::none(),
      nb::sig("def field(mesh: Mesh, array: Array, pressure: numpy.typing.ArrayLike, drives: numpy.typing.ArrayLike, "
              "points: numpy.typing.ArrayLike, wave: Wave | None = None, threads: int | None = None) -> "
              "numpy.typing.NDArray[numpy.complex128]"),
      "The pressure at points off the skin [Pa]: 0 inside the body, NaN on a transducer.");
}

}  // namespace touchfield::python
