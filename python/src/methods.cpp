#include <algorithm>
#include <map>
#include <nanobind/stl/map.h>
#include <nanobind/stl/variant.h>
#include <string>
#include <variant>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/method_solver.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "solvers/phase/optimality_bound.h"
#include "solvers/phase/radiation_bound.h"

namespace touchfield::python {

namespace {

using ProblemLike = Said<"numpy.typing.ArrayLike | Problem">;
using RadiationLike = Said<"numpy.typing.ArrayLike | RadiationProblem">;
using StartLike = Said<"str | numpy.typing.ArrayLike | Solution">;
using OptionalDrives = Said<"numpy.typing.ArrayLike | Solution">;
using AnyTarget = std::optional<SharedTarget>;
using Tolerances = std::optional<std::map<std::string, double>>;

/// A problem, which has its target, or that which `make` makes of an H and a target.
///
/// kind   what Python calls the problem
template <typename Problem, typename Make>
Problem given_problem(const char* who, const char* kind, nb::handle h, const AnyTarget& target, Make make) {
  const bool whole = nb::isinstance<Problem>(h);
  if (whole && target) {
    throw nb::type_error(fmt::format("{}: a problem has its target; leave out target", who).c_str());
  }
  if (!whole && !target) {
    const auto type = nb::cast<std::string>(h.type().attr("__name__"));
    throw nb::type_error(
        fmt::format("{}: h must be a touchfield.{}, or H with a target; it is of type {}, and target is None", who,
                    kind, type)
            .c_str());
  }
  return whole ? nb::cast<const Problem&>(h) : make(*target);
}

void require_steps(std::string_view who, int iterations) {
  require(iterations >= 1, "{}: iterations = {} must be >= 1", who, iterations);
}

ChannelTolerances tolerances_of(const char* who, const Tolerances& given) {
  ChannelTolerances tolerances;
  for (const auto& [name, value] : given.value_or(std::map<std::string, double>())) {
    double* member = name == "phase"  ? &tolerances.phase
                     : name == "gain" ? &tolerances.gain
                     : name == "dead" ? &tolerances.dead
                                      : nullptr;
    require(member != nullptr, "{}: tolerances: '{}' must be phase, gain or dead", who, name);
    require(value >= 0 && std::isfinite(value) && (name != "dead" || value < 1),
            "{}: tolerances: {} = {:g} must be >= 0{}", who, name, value, name == "dead" ? " and below 1" : "");
    *member = value;
  }
  return tolerances;
}

/// Drives to start from by name, or as they are: one column; none where the method finds its own.
Eigen::MatrixXcd start_of(nb::handle start, const SkinProblem& problem, const PhaseMethod& method) {
  const Eigen::Index channels = problem.channel_count();
  const std::string what = fmt::format("{}: start", method.name);
  if (start.is_none()) {
    return method.searches ? Eigen::MatrixXcd(channels, 0) : Eigen::MatrixXcd::Ones(channels, 1);
  }
  if (!nb::isinstance<nb::str>(start)) {
    return one_drive(start, what, channels);
  }
  const auto name = nb::cast<std::string>(start);
  if (name == "adjoint") {
    return adjoint_start(problem);
  }
  if (name == "spectral") {
    return spectral_start(problem);
  }
  require(name == "zero", "{} = '{}' must be adjoint, spectral, zero or a drive vector", what, name);
  return Eigen::MatrixXcd::Ones(channels, 1);
}

/// What all methods on rows of H take.
struct Question {
  const ProblemLike& h;
  const AnyTarget& target;
  double outside_weight = 0;
  std::optional<int> threads{};
  nb::handle start = nb::none();
  nb::handle progress = nb::none();
};

SharedSolution solved(const char* name, const Question& asked, MethodSettings settings) {
  const PhaseMethod& method = phase_method(name);
  require_steps(name, settings.iterations);
  const Reporting reporting(asked.progress);
  const auto problem =
      given_problem<SharedProblem>(name, "Problem", asked.h, asked.target, [&](const SharedTarget& target) {
        return skin_problem(name, asked.h, target, asked.outside_weight, asked.threads);
      });
  settings.search = method.searches && asked.start.is_none();
  const Eigen::MatrixXcd starts = start_of(asked.start, *problem, method);
  return computed(thread_count(asked.threads), [=, &method](Progress& progress) {
    progress.begin(method.name);
    return shared(method.solve(*problem, starts, settings, [&](int done, double) {
      progress.advance(static_cast<double>(done) / settings.iterations);
    }));
  });
}

SharedSolution surface(const ProblemLike& h, const AnyTarget& target, int iterations, const StartLike& start,
                       bool free_amplitudes, bool free_level, const Tolerances& tolerances, double outside_weight,
                       std::optional<int> threads, const Callback& progress) {
  return solved("surface", {h, target, outside_weight, threads, start, progress},
                {iterations, free_amplitudes, free_level, tolerances_of("surface", tolerances)});
}

SharedSolution radiation(const SharedRadiation& problem, const Eigen::MatrixXcd& starts,
                         const ChannelTolerances& tolerances, const RadiationOptions& options,
                         std::optional<int> threads) {
  return computed(thread_count(threads), [=](Progress& progress) {
    progress.begin("radiation");
    const RadiationProblem expected =
        tolerances.any() ? with_tolerances(problem->problem, tolerances) : problem->problem;
    return shared(
        solve_radiation(expected, starts.cols() > 0 ? starts : radiation_starts(expected), options,
                        [&](int done, double) { progress.advance(static_cast<double>(done) / options.iterations); }));
  });
}

SharedSolution radiation_of(const RadiationLike& h, const AnyTarget& target, int iterations,
                            const OptionalDrives& start, bool free_amplitudes, bool free_level,
                            const Tolerances& tolerances, double outside_weight, const std::optional<Wave>& wave,
                            std::optional<int> threads, const Callback& progress) {
  require_steps("radiation", iterations);
  const Reporting reporting(progress);
  const auto problem =
      given_problem<SharedRadiation>("radiation", "RadiationProblem", h, target, [&](const SharedTarget& wanted) {
        return radiation_problem("radiation", h, wanted, outside_weight, wave, threads);
      });
  const Eigen::Index channels = problem->problem.channel_count();
  return radiation(problem,
                   start.is_none() ? Eigen::MatrixXcd(channels, 0) : drive_columns(start, "radiation: start", channels),
                   tolerances_of("radiation", tolerances),
                   {.iterations = iterations, .free_amplitudes = free_amplitudes, .free_level = free_level}, threads);
}

Values optimality_bound(const std::variant<SharedProblem, SharedRadiation>& problem, std::optional<int> threads,
                        const OptionalDrives& start) {
  OptimalityBound found;
  if (const auto* skin = std::get_if<SharedProblem>(&problem)) {
    found = computed(thread_count(threads), [given = *skin](Progress&) { return prove_bound(*given); });
  } else {
    const auto given = std::get<SharedRadiation>(problem);
    const Eigen::Index channels = given->problem.channel_count();
    const Eigen::VectorXcd near = start.is_none() ? drive(*radiation(given, Eigen::MatrixXcd(channels, 0), {},
                                                                     {.free_level = MethodSpec{}.free_level}, threads))
                                                  : one_drive(start, "optimality_bound: start", channels);
    found = computed(thread_count(threads), [=](Progress&) { return prove_radiation_bound(given->problem, near); });
  }
  nb::dict values;
  values["bound"] = found.bound;
  values["relaxed"] = found.relaxed;
  values["iterations"] = found.iterations;
  values["converged"] = found.converged;
  return values;
}

SharedSolution focus(const ArrayLike& h, const SharedTarget& target) {
  const nb::object rows = nb::module_::import_("numpy").attr("atleast_1d")(h);
  const auto count = static_cast<Eigen::Index>(nb::len(rows));
  std::ptrdiff_t row = central_face(*target.skin.mesh, *target);
  if (count == target->size()) {
    row = std::ranges::lower_bound(target->faces, row) - target->faces.begin();
  } else {
    require_count("focus: h", count, target.skin.mesh->face_count(), "per face");
  }
  return shared(full_drive(-complex_list(rows[row], fmt::format("focus: h[{}]", row)).cwiseArg()));
}

/// Method `paper` or `unscattered`.
template <bool scattered>
SharedSolution solve_by_paper(const SharedModel& model, int iterations, const std::string& faces,
                              std::optional<int> threads, const Callback& progress) {
  MethodSpec method;
  method.kind = &phase_method(scattered ? "paper" : "unscattered");
  method.name = method.kind->name;
  require_steps(method.name, iterations);
  require(faces == "equal" || faces == "area", "{}: faces = '{}' must be equal or area", method.name, faces);
  const Reporting reporting(progress);
  method.scheme = model->fixed->scene.solve.scheme;
  method.iterations = iterations;
  method.faces = faces == "area" ? FaceWeights::kArea : FaceWeights::kEqual;
  return computed(thread_count(threads), [=](Progress& task) {
    return asked(*model, method.scheme, model->fixed->scene.solve, task,
                 [&](MethodSolver& solver, const Target& target) {
                   return shared(solver.solve(method, target.amplitudes, task));
                 });
  });
}

std::string doc_of(const char* name, const char* rest) { return fmt::format("{}\n{}", phase_method(name).help, rest); }

void add_main_methods(nb::module_& module) {
  module.def("surface", &surface, nb::arg("h"), nb::arg("target") = nb::none(), nb::kw_only(),
             nb::arg("iterations") = kUsualIterations, nb::arg("start") = nb::none(),
             nb::arg("free_amplitudes") = MethodSettings{}.free_amplitudes,
             nb::arg("free_level") = MethodSettings{}.free_level, nb::arg("tolerances") = nb::none(),
             nb::arg("outside_weight") = SolveSpec{}.outside_weight, nb::arg("threads") = nb::none(),
             nb::arg("progress") = nb::none(),
             doc_of("surface", R"(
Parameters
----------
h : array_like of complex, shape (M, N) or (K, N), or Problem
    The transfer matrix, of every face or of those of the target.
target : Target
    Not needed with a `Problem`.
iterations : int
start : {"adjoint", "spectral", "zero"} or array_like of complex, shape (N,), or Solution, optional
    Default: several starts are tried.
free_amplitudes : bool
    Whether the amplitudes of the channels are found too.
free_level : bool
    Whether their common amplitude is found too.
tolerances : dict, optional
    How far the channels of the real array may be from their design, rms over the array: "phase" [rad], "gain"
    (relative) and "dead" (share of the channels). The expected misfit is then minimised, over phases and a common
    amplitude.
outside_weight : float
    Weight of the skin outside the target.
threads : int, optional
progress : callable or bool, optional
    A function of stage and fraction, or True for a bar.

Returns
-------
Solution

Raises
------
InputError
    On sizes that do not fit, or a number that is not finite.

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 20)
>>> solution = tf.surface(tf.transfer(ball, array), target, iterations=10)
>>> robust = tf.surface(tf.transfer(ball, array), target, tolerances={"phase": 0.35, "gain": 0.1})
)")
                 .c_str());
  module.def("radiation", &radiation_of, nb::arg("h"), nb::arg("target") = nb::none(), nb::kw_only(),
             nb::arg("iterations") = kUsualDescents, nb::arg("start") = nb::none(), nb::arg("free_amplitudes") = false,
             nb::arg("free_level") = MethodSpec{}.free_level, nb::arg("tolerances") = nb::none(),
             nb::arg("outside_weight") = MethodSpec{}.outside_weight, nb::arg("wave") = nb::none(),
             nb::arg("threads") = nb::none(), nb::arg("progress") = nb::none(),
             doc_of("radiation", R"(
Parameters
----------
h : array_like of complex, shape (M, N), or RadiationProblem
    The transfer matrix of every face.
target : Target
    Not needed with a `RadiationProblem`.
iterations : int
    Most steps. It ends before where the cost stands still.
start : array_like of complex, shape (N,) or (N, S), or Solution, optional
    One or several starts, of which the best continues. Default: three, one of the target and two random ones.
outside_weight : float
    Weight of the energy of the skin outside the target.
wave : Wave, optional
    That of H. Default: 40 kHz at 20 degrees C.
free_amplitudes, free_level, tolerances, threads, progress
    As of `surface`.

Returns
-------
Solution

Raises
------
InputError
    As `surface`.

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 20)
>>> solution = tf.radiation(tf.transfer(ball, array), target, iterations=10)
)")
                 .c_str());
}

/// Methods for comparison, whose arguments are those of `surface`.
void add_other_methods(nb::module_& module) {
  const auto add = [&](const char* name, const char* takes, const auto& solve, const auto&... arguments) {
    const std::string doc = fmt::format(
        R"({}

Parameters
----------
h, target, {}threads
    As of `surface`{}.

Returns
-------
Solution

Examples
--------
>>> solution = tf.{}(tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1]))
)",
        phase_method(name).help, takes,
        std::string_view(takes).find("start") != std::string_view::npos ? "; default of `start`: zero" : "", name);
    module.def(name, solve, nb::arg("h"), nb::arg("target") = nb::none(), nb::kw_only(), arguments...,
               nb::arg("threads") = nb::none(), doc.c_str());
  };
  const auto iterations = nb::arg("iterations") = kUsualIterations;
  const auto start = nb::arg("start") = nb::none();
  const auto progress = nb::arg("progress") = nb::none();
  add(
      "lbfgs", "iterations, start, outside_weight, progress, ",
      [](const ProblemLike& h, const AnyTarget& target, int steps, const StartLike& from, double outside_weight,
         const Callback& report, std::optional<int> threads) {
        return solved("lbfgs", {h, target, outside_weight, threads, from, report}, {steps});
      },
      iterations, start, nb::arg("outside_weight") = SolveSpec{}.outside_weight, progress);
  for (const char* name : {"gs", "wgs"}) {
    add(
        name, "iterations, start, progress, ",
        [name](const ProblemLike& h, const AnyTarget& target, int steps, const StartLike& from, const Callback& report,
               std::optional<int> threads) {
          return solved(name, {h, target, 0, threads, from, report}, {steps});
        },
        iterations, start, progress);
  }
  add(
      "gs_pat", "iterations, ",
      [](const ProblemLike& h, const AnyTarget& target, int steps, std::optional<int> threads) {
        return solved("gs_pat", {h, target, 0, threads}, {steps});
      },
      iterations);
  add("eigen", "", [](const ProblemLike& h, const AnyTarget& target, std::optional<int> threads) {
    return solved("eigen", {h, target, 0, threads}, {});
  });
}

}  // namespace

void add_methods(nb::module_& module) {
  add_main_methods(module);
  add_other_methods(module);
  module.def("focus", &focus, nb::arg("h"), nb::arg("target"),
             doc_of("focus", R"(
Parameters
----------
h : array_like of complex, shape (M, N) or (K, N)
    The transfer matrix, of every face or of those of the target.
target : Target
    They meet at the face in its centre.

Returns
-------
Solution

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 800)
>>> solution = tf.focus(tf.transfer(ball, array), target)
)")
                 .c_str());
  module.def(
      "paper", &solve_by_paper<true>, nb::arg("model"), nb::kw_only(), nb::arg("iterations") = kUsualIterations,
      nb::arg("faces") = "equal", nb::arg("threads") = nb::none(), nb::arg("progress") = nb::none(),
      R"(The published optimisation of the scattered field. It works on the equations of the skin itself, not on H.

Parameters
----------
model : Model
    Of a scene; of parts: ``Model({"array": array, "body": mesh, "target": target, "solve": {"methods": ["paper"]}})``.
iterations : int
faces : {"equal", "area"}
    Weights of the faces in the misfit: as published, or their areas.
threads : int, optional
progress : callable or bool, optional

Examples
--------
>>> solution = tf.paper(tf.Model("capsule"), iterations=3)
)");
  module.def("unscattered", &solve_by_paper<false>, nb::arg("model"), nb::kw_only(),
             nb::arg("iterations") = kUsualIterations, nb::arg("faces") = "equal", nb::arg("threads") = nb::none(),
             nb::arg("progress") = nb::none(), R"(The method `paper` as if the body did not scatter, for comparison.

Parameters
----------
model, iterations, faces, threads, progress
    As of `paper`.

Examples
--------
>>> solution = tf.unscattered(tf.Model("capsule"), iterations=3)
)");
  module.def("optimality_bound", &optimality_bound, nb::arg("problem"), nb::arg("threads") = nb::none(),
             nb::arg("start") = nb::none(),
             R"(The optimality bound: a proved lower bound of the cost over all drive vectors.

Parameters
----------
problem : Problem or RadiationProblem
threads : int, optional
start : array_like of complex, shape (N,), or Solution, optional
    Of a `RadiationProblem`: drives near which the bound is sought, best those of `radiation`. Default: they are
    computed.

Returns
-------
dict
    `bound` in the unit of the cost, `relaxed`, `iterations`, `converged`.

Examples
--------
>>> problem = tf.Problem([[1, 1j], [1j, 1], [1, 1]], [1, 1, 0.1], [1, 1, 1])
>>> tf.optimality_bound(problem)["bound"] <= problem.cost(tf.surface(problem))
True
)");
}

}  // namespace touchfield::python
