#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/method_solver.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/field/skin_problems.h"
#include "sim/run/solve_model.h"
#include "solvers/phase/skin_jacobian.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield::python {

namespace {

SharedProblem problem_of_model(const SharedModel& model, std::optional<int> threads) {
  return computed(thread_count(threads), [model](Progress& progress) {
    const SolveSpec& spec = model->fixed->scene.solve;
    return asked(*model, spec.scheme, spec, progress, [&](MethodSolver& solver, const Target& target) {
      RunTransfer transfer = solver.run_transfer(target.amplitudes, progress);
      transfer.problem.device.reset();  // of a card, which is let go of
      return shared(std::move(transfer.problem));
    });
  });
}

SharedProblem problem_of(nb::handle target, nb::handle amplitudes, nb::handle weights, nb::handle outside,
                         nb::handle shares) {
  SkinProblem problem;
  problem.target = complex_table(target, "Problem: target");
  problem.amplitudes = real_list(amplitudes, "Problem: amplitudes");
  problem.weights = real_list(weights, "Problem: weights");
  problem.outside =
      outside.is_none() ? Eigen::MatrixXcd(0, problem.target.cols()) : complex_table(outside, "Problem: outside");
  problem.shares = shares.is_none() ? Eigen::VectorXd() : Eigen::VectorXd(real_list(shares, "Problem: shares"));
  require_valid(problem, "Problem");
  return shared(std::move(problem));
}

Numbers evaluate_phases(const SharedModel& model, const DrivesLike& drives, std::optional<int> threads) {
  const OwnMethod given = own_method("given", drives, "evaluate: drives");
  const Metrics metrics = computed(thread_count(threads), [model, given](Progress& progress) {
    FixedModel fixed = *model->fixed;
    fixed.scene.solve.methods.clear();
    fixed.scene.solve.optimality_bound = false;
    fixed.scene.write.transfer = false;
    fixed.fields.clear();
    Model alone = *model;
    if (asks_for_best(alone)) {  // as of 1 Pa
      alone.posture.target->pressure = fixed.scene.target->pressure = 1.0;
    }
    alone.fixed = std::make_shared<const FixedModel>(std::move(fixed));
    return solve_model(
               with_own(alone, {given}), {}, [](const Run&) {}, progress)
        .methods.front()
        .metrics;
  });
  return metrics_dict(*model, metrics);
}

double cost(const SharedProblem& problem, const DrivesLike& drives) {
  return skin_cost(*problem, one_drive(drives, "cost: drives", problem->channel_count()));
}

ComplexArray gradient(const SharedProblem& problem, const DrivesLike& drives, std::optional<int> threads) {
  const Eigen::VectorXcd q = one_drive(drives, "gradient: drives", problem->channel_count());
  return owned(computed(thread_count(threads), [=](Progress&) { return skin_gradient(*problem, q); }));
}

/// The parts of a solution, of which it can be made again.
PhaseSolution solution_of_state(const nb::tuple& state) {
  PhaseSolution solution;
  solution.phases = real_list(state[0], "Solution: state");
  solution.amplitudes = real_list(state[1], "Solution: state");
  const Eigen::VectorXd history = real_list(state[2], "Solution: state");
  solution.cost_history.assign(history.begin(), history.end());
  solution.iterations = nb::cast<int>(state[3]);
  solution.status = static_cast<PhaseStatus>(nb::cast<int>(state[4]));
  return solution;
}

void add_problem(nb::module_& module) {
  nb::class_<SharedProblem>(
      module, "Problem", nb::type_slots(kOpenInit),
      R"(The misfit on the skin that `surface` minimises: sum_j w_j (abs(h_j q) - p'_j)^2 + abs(R q)^2.

Parameters
----------
target : array_like of complex, shape (K, N)
    Rows h_j of the transfer matrix at the faces of the target [Pa].
amplitudes : array_like, shape (K,)
    Wanted pressure amplitudes p' [Pa].
weights : array_like, shape (K,)
    w, areas of the target on the faces [m2].
outside : array_like of complex, shape (r, N), optional
    R, rows of the skin outside the target [Pa m].
shares : array_like, shape (K,), optional
    Shares of the faces in the target: `gs`, `wgs`, `gs_pat` and `eigen` want shares * amplitudes. All 1 if left out.

Raises
------
InputError
    On sizes that do not fit, or a number that is not finite.

Examples
--------
>>> problem = tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1])
>>> problem.cost([1, 0])
0.0
)")
      .def(
          "__init__",
          [](SharedProblem* self, const ArrayLike& target, const ArrayLike& amplitudes, const ArrayLike& weights,
             const ArrayLike& outside, const ArrayLike& shares) {
            new (self) SharedProblem(problem_of(target, amplitudes, weights, outside, shares));
          },
          nb::arg("target"), nb::arg("amplitudes"), nb::arg("weights"), nb::arg("outside") = nb::none(),
          nb::arg("shares") = nb::none())
      .def_static(
          "of",
          [](const ArrayLike& h, const SharedTarget& target, double outside_weight, std::optional<int> threads) {
            return skin_problem("Problem.of", h, target, outside_weight, threads);
          },
          nb::arg("h"), nb::arg("target"), nb::arg("outside_weight") = 1.0, nb::arg("threads") = nb::none(),
          R"(The problem of a transfer matrix and a target.

Parameters
----------
h : array_like of complex, shape (M, N) or (K, N)
    Of every face of `target.mesh`, or of those of the target alone, without the skin outside.
target : Target
outside_weight : float
    Weight of the skin outside the target, >= 0.
threads : int, optional

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 800)
>>> problem = tf.Problem.of(tf.transfer(ball, array), target)
)")
      .def_static("of_model", &problem_of_model, nb::arg("model"), nb::arg("threads") = nb::none(),
                  R"(The problem of the methods of a scene.

Parameters
----------
model : Model
threads : int, optional

Returns
-------
Problem
    With it methods find what a run of the scene finds. Where the scene asks for the best pressure, that is found
    first, by nine solutions of the scene's first method: `amplitudes` has it.

Examples
--------
>>> problem = tf.Problem.of_model(tf.Model("capsule"))
)")
      .def_prop_ro("target", part_of<SharedProblem>(&SkinProblem::target),
                   "Rows of the transfer matrix, shape (K, N) [Pa].")
      .def_prop_ro("amplitudes", part_of<SharedProblem>(&SkinProblem::amplitudes),
                   "Wanted pressure amplitudes, shape (K,) [Pa].")
      .def_prop_ro("weights", part_of<SharedProblem>(&SkinProblem::weights), "Areas, shape (K,) [m2].")
      .def_prop_ro("shares", part_of<SharedProblem>(&SkinProblem::shares),
                   "Shares of the faces in the target, shape (K,); empty: all 1.")
      .def_prop_ro("outside", part_of<SharedProblem>(&SkinProblem::outside),
                   "Rows of the skin outside the target, shape (r, N) [Pa m].")
      .def("__getstate__",
           [](const SharedProblem& self) {
             return nb::make_tuple(owned(self->target), owned(self->amplitudes), owned(self->weights),
                                   owned(self->outside), owned(self->shares));
           })
      .def("__setstate__",
           [](SharedProblem& self, const nb::tuple& state) {
             new (&self) SharedProblem(problem_of(state[0], state[1], state[2], state[3], state[4]));
           })
      .def("cost", &cost, nb::arg("drives"), R"(The misfit of a drive vector.

Parameters
----------
drives : array_like of complex, shape (N,), or Solution

Returns
-------
float
    [Pa2 m2]

Examples
--------
>>> tf.Problem([[1, 1]], [1], [1]).cost([1, 1])
1.0
)")
      .def("gradient", &gradient, nb::arg("drives"), nb::arg("threads") = nb::none(),
           R"(The gradient of the cost by the drives q = a exp(i phi): g = dC/d Re q + i dC/d Im q.

The cost of q + dq is that of q plus ``sum(real(conj(g) * dq))``. So dC/d phi is ``imag(conj(q) * g)``, and dC/d a is
``real(exp(-1j * phi) * g)``.

Parameters
----------
drives : array_like of complex, shape (N,), or Solution
threads : int, optional

Returns
-------
numpy.ndarray of complex, shape (N,)
    [Pa2 m2]. Where the pressure on a face of the target is 0 the cost has a kink: one of its subgradients.

Examples
--------
>>> tf.Problem([[1, 1]], [1], [1]).gradient([1, 1])
array([2.+0.j, 2.+0.j])
)")
      .def("__repr__", [](const SharedProblem& self) {
        return fmt::format("<touchfield.Problem: {} faces, {} channels, {} rows for the skin outside>",
                           self->target_count(), self->channel_count(), self->outside.rows());
      });
}

void add_solution(nb::module_& module) {
  nb::class_<SharedSolution>(module, "Solution", "The drive vector that a phase method found.")
      .def_prop_ro("phases", part_of<SharedSolution>(&PhaseSolution::phases), "0 to 2 pi [rad], shape (N,).")
      .def_prop_ro("amplitudes", part_of<SharedSolution>(&PhaseSolution::amplitudes), "0 to 1, shape (N,).")
      .def_prop_ro(
          "drives", [](const SharedSolution& self) { return owned(drive(*self)); },
          "Amplitude exp(i phase), shape (N,).")
      .def_prop_ro("cost_history", part_of<SharedSolution>(&PhaseSolution::cost_history),
                   "Cost before the first and after each iteration; empty for a direct method.")
      .def_prop_ro(
          "iterations", [](const SharedSolution& self) { return self->iterations; }, "Steps tried.")
      .def_prop_ro(
          "status", [](const SharedSolution& self) { return to_string(self->status); },
          "converged, iteration_limit, stalled or direct.")
      .def("__getstate__",
           [](const SharedSolution& self) {
             return nb::make_tuple(owned(self->phases), owned(self->amplitudes), owned(self->cost_history),
                                   self->iterations, static_cast<int>(self->status));
           })
      .def("__setstate__", [](SharedSolution& self,
                              const nb::tuple& state) { new (&self) SharedSolution(shared(solution_of_state(state))); })
      .def("__repr__", [](const SharedSolution& self) {
        return fmt::format("<touchfield.Solution: {} channels, {} after {} iterations>", self->phases.size(),
                           to_string(self->status), self->iterations);
      });
}

}  // namespace

SharedProblem skin_problem(std::string_view who, nb::handle h, const SharedTarget& target, double outside_weight,
                           std::optional<int> threads) {
  const auto mesh = target.skin.mesh;
  const std::string what = std::string(who) + ": h";
  const Eigen::VectorXd& wanted = target.amplitudes();
  Eigen::MatrixXcd rows = complex_table(h, what);
  if (rows.rows() == target->size()) {
    SkinProblem problem{std::move(rows), wanted, target->areas(mesh->areas()), Eigen::MatrixXcd(0, 0)};
    problem.outside.resize(0, problem.target.cols());
    problem.shares = target->shares;
    require_valid(problem, "Problem");
    return shared(std::move(problem));
  }
  require_count(what, rows.rows(), mesh->face_count(), "per face");
  require(outside_weight >= 0 && std::isfinite(outside_weight), "{}: outside_weight = {:g} must be >= 0", who,
          outside_weight);
  Eigen::VectorXd outside;
  if (outside_weight > 0) {
    outside = OutsideSkin().face_weights(mesh->areas(), *target, outside_weight);
  }
  return computed(thread_count(threads), [=](Progress&) {
    const Eigen::MatrixXcd each = Eigen::MatrixXcd::Identity(rows.cols(), rows.cols());
    return shared(reduced_skin_problem(rows, each, mesh->areas(), *target, outside, kOutsideTolerance).problem);
  });
}

double best_scale_of(const Model& model, Progress& progress) {
  const Scene& scene = model.fixed->scene;
  const MethodSpec& first = scene.solve.methods.front();
  std::vector<SolveRecord> records;
  const auto scattering = make_scattering("python", model.body.mesh, first.scheme, scene.solve.solver,
                                          largest_block(scene, first.scheme, model.fixed->array.size(), false), model,
                                          model.fixed->array.response, nullptr, records, progress);
  MethodSolver solver(*scattering, model.fixed->array.size(), build_target(model), scene.solve, outside_skin(model));
  return solver.best_scale(first, model.body.mesh, model.boxes, progress);
}

Eigen::VectorXcd one_drive(nb::handle drives, const std::string& what, Eigen::Index channels) {
  Eigen::VectorXcd q = complex_list(drives, what);
  require_count(what, q.size(), channels, "per channel");
  return q;
}

void add_problems(nb::module_& module) {
  add_problem(module);
  add_solution(module);
  module.def("evaluate", &evaluate_phases, nb::arg("model"), nb::arg("drives"), nb::arg("threads") = nb::none(),
             R"(The metrics of drives on the evaluation mesh of a scene, as for a method of the program.

Parameters
----------
model : Model
drives : array_like, shape (N,), or Solution
    Phases [rad], or complex drives of amplitudes 0 to 1.
threads : int, optional

Examples
--------
>>> model = tf.Model("capsule")
>>> metrics = tf.evaluate(model, tf.focus(tf.transfer(model.mesh, model.array, model.wave), model.target))
)");
}

}  // namespace touchfield::python
