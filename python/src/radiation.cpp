#include "solvers/phase/radiation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/method_solver.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/field/radiation_skin.h"
#include "sim/field/skin_problems.h"
#include "sim/field/surface_gradient.h"

namespace touchfield::python {

namespace {

using SlopesLike = Said<"scipy.sparse.sparray | tuple">;
using SlopesParts = Said<"tuple[numpy.ndarray, numpy.ndarray, numpy.ndarray]">;

/// As scipy.sparse.csr_array takes them.
SlopesParts parts_of(const SkinSlopes& slopes) {
  std::vector<double> values;
  std::vector<std::int64_t> columns;
  std::vector<std::int64_t> starts = {0};
  for (Eigen::Index row = 0; row < slopes.rows(); ++row) {
    for (SkinSlopes::InnerIterator entry(slopes, row); entry; ++entry) {
      values.push_back(static_cast<double>(entry.value()));
      columns.push_back(entry.col());
    }
    starts.push_back(static_cast<std::int64_t>(values.size()));
  }
  return nb::object(nb::make_tuple(owned(std::move(values)), owned(std::move(columns)), owned(std::move(starts))));
}

SkinSlopes slopes_of(nb::handle given, Eigen::Index rows, Eigen::Index columns) {
  const std::string what = "RadiationProblem: slopes";
  nb::object parts = nb::borrow(given);
  if (nb::hasattr(given, "tocsr")) {
    const nb::object matrix = given.attr("tocsr")();
    parts = nb::make_tuple(matrix.attr("data"), matrix.attr("indices"), matrix.attr("indptr"));
  }
  if (!nb::isinstance<nb::tuple>(parts) || nb::len(parts) != 3) {
    throw InputError(fmt::format("{} must be a matrix of scipy.sparse or the tuple (data, indices, indptr)", what));
  }
  const Eigen::VectorXd values = real_list(parts[0], what + "[0]");
  const std::vector<Eigen::Index> column = index_list(parts[1], what + "[1]", columns);
  require_count(what + "[1]", static_cast<Eigen::Index>(column.size()), values.size(), "per value");
  const std::vector<Eigen::Index> start = index_list(parts[2], what + "[2]", values.size() + 1);
  require_count(what + "[2]", static_cast<Eigen::Index>(start.size()), rows + 1, "per row, of 2 per face, and the end");
  if (start.front() != 0 || start.back() != values.size() || !std::ranges::is_sorted(start)) {
    throw InputError(fmt::format("{}[2] must ascend from 0 to the number of values, {}", what, values.size()));
  }
  std::vector<Eigen::Triplet<float>> entries;
  for (std::size_t row = 0; row + 1 < start.size(); ++row) {
    for (Eigen::Index i = start[row]; i < start[row + 1]; ++i) {
      entries.emplace_back(static_cast<Eigen::Index>(row), column[static_cast<std::size_t>(i)],
                           static_cast<float>(values(i)));
    }
  }
  SkinSlopes slopes(rows, columns);
  slopes.setFromTriplets(entries.begin(), entries.end());
  return slopes;
}

RadiationProblem problem_of(nb::handle h, nb::handle slopes, nb::handle wanted, nb::handle weights, nb::handle energies,
                            RadiationSkin skin) {
  RadiationProblem problem;
  problem.rows = complex_table(h, "RadiationProblem: h");
  const Eigen::Index rows = problem.rows.rows();
  problem.outside.resize(0, problem.rows.cols());
  skin.wanted = real_list(wanted, "RadiationProblem: wanted");
  skin.weights = real_list(weights, "RadiationProblem: weights");
  skin.energies =
      energies.is_none() ? Eigen::VectorXd::Zero(rows).eval() : real_list(energies, "RadiationProblem: energies");
  require_count("RadiationProblem: weights", skin.weights.size(), skin.wanted.size(), "per wanted pressure");
  require_count("RadiationProblem: energies", skin.energies.size(), rows, "per row of h");
  skin.slopes = std::make_shared<SkinSlopes>(slopes_of(slopes, 2 * skin.wanted.size(), rows));
  problem.skin = std::move(skin);
  require_valid(problem, "RadiationProblem");
  return problem;
}

/// The rows of R behind those of F.
SharedRadiation joined(RadiationProblem problem, const std::vector<Eigen::Index>& faces) {
  Eigen::MatrixXcd all(problem.rows.rows() + problem.outside.rows(), problem.channel_count());
  all << problem.rows, problem.outside;
  problem.rows = std::move(all);
  problem.outside.resize(0, problem.channel_count());
  const auto count = static_cast<std::ptrdiff_t>(problem.skin.face_count());
  return shared(SkinRadiation{std::move(problem), {faces.begin(), faces.begin() + count}});
}

/// Method radiation of a scene, the first one, or with its defaults.
MethodSpec radiation_of(const SolveSpec& spec) {
  const auto found =
      std::ranges::find_if(spec.methods, [](const MethodSpec& method) { return method.kind->radiation; });
  if (found != spec.methods.end()) {
    return *found;
  }
  MethodSpec method;
  method.kind = &phase_method("radiation");
  method.name = method.kind->name;
  method.scheme = spec.scheme;
  return method;
}

SharedRadiation problem_of_model(const SharedModel& model, std::optional<int> threads) {
  return computed(thread_count(threads), [model](Progress& progress) {
    SolveSpec spec = model->fixed->scene.solve;
    const MethodSpec method = radiation_of(spec);
    spec.methods = {method};
    return asked(*model, method.scheme, spec, progress, [&](MethodSolver& solver, const Target& target) {
      return joined(solver.radiation_problem(method, target.amplitudes, progress),
                    near_skin(model->body.mesh, target, model->fixed->wave).faces);
    });
  });
}

Eigen::VectorXcd drives_of(const SharedRadiation& problem, const DrivesLike& drives, const char* what) {
  return one_drive(drives, what, problem->problem.channel_count());
}

ComplexArray gradient(const SharedRadiation& problem, const DrivesLike& drives, std::optional<int> threads) {
  const Eigen::VectorXcd q = drives_of(problem, drives, "gradient: drives");
  return owned(computed(thread_count(threads), [=](Progress&) { return radiation_gradient(problem->problem, q); }));
}

template <auto part>
auto view_of_skin() {
  return [](nb::handle_t<SharedRadiation> self) {
    return view(nb::cast<const SharedRadiation&>(self)->problem.skin.*part, self);
  };
}

nb::tuple state_of(const SharedRadiation& self) {
  const RadiationSkin& skin = self->problem.skin;
  return nb::make_tuple(owned(self->problem.rows), parts_of(*skin.slopes), owned(skin.wanted), owned(skin.weights),
                        owned(skin.energies), skin.press, skin.flow, skin.constant, owned(self->faces));
}

void set_state(SharedRadiation& self, const nb::tuple& state) {
  RadiationSkin skin;
  skin.press = nb::cast<double>(state[5]);
  skin.flow = nb::cast<double>(state[6]);
  skin.constant = nb::cast<double>(state[7]);
  RadiationProblem problem = problem_of(state[0], state[1], state[2], state[3], state[4], std::move(skin));
  const auto faces = nb::cast<std::vector<std::int64_t>>(nb::object(nb::list(state[8])));
  new (&self) SharedRadiation(shared(SkinRadiation{std::move(problem), faces}));
}

SlopesParts slopes_of_mesh(const SkinMesh& mesh, const std::optional<Wave>& wave, std::optional<int> threads) {
  std::vector<Eigen::Index> faces(static_cast<std::size_t>(mesh.mesh->face_count()));
  std::iota(faces.begin(), faces.end(), Eigen::Index{0});
  return parts_of(computed(thread_count(threads), [=, k = wave_or_default(wave).k()](Progress&) {
    return surface_slopes(*mesh.mesh, k, faces);
  }));
}

void add_parts(nb::class_<SharedRadiation>& kind) {
  kind.def_prop_ro(
          "h",
          [](nb::handle_t<SharedRadiation> self) {
            return view(nb::cast<const SharedRadiation&>(self)->problem.rows, self);
          },
          "Rows of the transfer matrix, shape (L, N) [Pa]: of the M faces, of their neighbours, and of the rest.")
      .def_prop_ro(
          "slopes", [](const SharedRadiation& self) { return parts_of(*self->problem.skin.slopes); },
          "D as (data, indices, indptr), which scipy.sparse.csr_array takes [1/m].")
      .def_prop_ro("wanted", view_of_skin<&RadiationSkin::wanted>(), "Wanted radiation pressure, shape (M,) [Pa].")
      .def_prop_ro("weights", view_of_skin<&RadiationSkin::weights>(), "w, shape (M,) [1/Pa2].")
      .def_prop_ro("energies", view_of_skin<&RadiationSkin::energies>(), "e, shape (L,) [1/Pa2].")
      .def_prop_ro(
          "constant", [](const SharedRadiation& self) { return self->problem.skin.constant; },
          "Share of the cost that border faces always have.")
      .def_prop_ro(
          "faces",
          [](nb::handle_t<SharedRadiation> self) { return view(nb::cast<const SharedRadiation&>(self)->faces, self); },
          "Numbers of the M faces in the mesh; empty for a problem of matrices.");
}

void add_functions(nb::class_<SharedRadiation>& kind) {
  kind.def(
          "cost",
          [](const SharedRadiation& self, const DrivesLike& drives) {
            return radiation_cost(self->problem, drives_of(self, drives, "cost: drives"));
          },
          nb::arg("drives"), R"(The cost of a drive vector.

Parameters
----------
drives : array_like of complex, shape (N,), or Solution

Returns
-------
float
    Without a unit.

Examples
--------
>>> problem = tf.RadiationProblem([[1, 1]], ([], [], [0, 0, 0]), wanted=[2], weights=[0.25])
>>> problem.cost([0, 0])
1.0
)")
      .def("gradient", &gradient, nb::arg("drives"), nb::arg("threads") = nb::none(),
           R"(The gradient of the cost by the drives, as `Problem.gradient`.

Parameters
----------
drives : array_like of complex, shape (N,), or Solution
threads : int, optional

Returns
-------
numpy.ndarray of complex, shape (N,)
    dC/d Re q + i dC/d Im q.

Examples
--------
>>> problem = tf.RadiationProblem([[1, 1]], ([], [], [0, 0, 0]), wanted=[2], weights=[0.25])
>>> problem.gradient([0, 0])
array([0.+0.j, 0.+0.j])
)")
      .def(
          "radiation",
          [](const SharedRadiation& self, const DrivesLike& drives) {
            const Eigen::VectorXcd pressure = self->problem.rows * drives_of(self, drives, "radiation: drives");
            return owned(radiation_of(self->problem.skin, pressure));
          },
          nb::arg("drives"), R"(The radiation pressure P of a drive vector.

Parameters
----------
drives : array_like of complex, shape (N,), or Solution

Returns
-------
ndarray of float, shape (M,)
    Of the faces [Pa], above 0 inwards.

Examples
--------
>>> problem = tf.RadiationProblem([[1000, 1000]], ([], [], [0, 0, 0]), wanted=[2], weights=[0.25])
>>> problem.radiation([1, 1]).round(2)
array([7.05])
)")
      .def("__getstate__", &state_of)
      .def("__setstate__", &set_state)
      .def("__repr__", [](const SharedRadiation& self) {
        return fmt::format("<touchfield.RadiationProblem: {} faces, {} channels, {} rows>",
                           self->problem.skin.face_count(), self->problem.channel_count(), self->problem.rows.rows());
      });
}

}  // namespace

SharedRadiation radiation_problem(std::string_view who, nb::handle h, const SharedTarget& target, double outside_weight,
                                  const std::optional<Wave>& wave, std::optional<int> threads) {
  const std::string what = std::string(who) + ": h";
  const auto mesh = target.skin.mesh;
  const Eigen::MatrixXcd rows = complex_table(h, what);
  require_count(what, rows.rows(), mesh->face_count(), "per face");
  require(outside_weight >= 0 && std::isfinite(outside_weight), "{}: outside_weight = {:g} must be >= 0", who,
          outside_weight);
  return computed(thread_count(threads), [=, sound = wave_or_default(wave)](Progress&) {
    const NearSkin near = near_skin(*mesh, *target, sound);
    const OutsideSkin outside;
    RadiationProblem problem{.rows = rows(near.faces, Eigen::all)};
    const Eigen::MatrixXcd each = Eigen::MatrixXcd::Identity(rows.cols(), rows.cols());
    problem.outside = reduced_skin_problem(rows, each, mesh->areas(), *target,
                                           outside.face_weights(mesh->areas(), *target, 1.0), kOutsideTolerance)
                          .problem.outside;
    Eigen::VectorXd counted = Eigen::VectorXd::Zero(problem.rows.rows() + problem.outside.rows());
    counted.tail(problem.outside.rows()).setOnes();
    problem.skin = radiation_skin(near, *mesh, *target, target.amplitudes(), outside, sound, outside_weight, counted);
    return joined(std::move(problem), near.faces);
  });
}

void add_radiation(nb::module_& module) {
  nb::class_<SharedRadiation> kind(module, "RadiationProblem", nb::type_slots(kOpenInit),
                                   R"(The misfit of the radiation pressure, which `radiation` minimises:

    sum_j w_j (P_j - P'_j)^2 + sum_i e_i abs(p_i)^2 + constant,   p = H q,
    P_j = abs(p_j)^2 / (4 rho c^2) - (abs((D p)_2j)^2 + abs((D p)_2j+1)^2) / (4 rho omega^2)

Parameters
----------
h : array_like of complex, shape (L, N)
    H, rows of the transfer matrix [Pa]: first those of the M faces with a wanted P, then any others.
slopes : scipy.sparse matrix, shape (2 M, L), or tuple
    D [1/m]: rows 2j and 2j + 1 are the slopes of the pressure at face j along two directions at right angles. A tuple
    is (data, indices, indptr), as of `surface_slopes` and scipy.sparse.csr_array.
wanted : array_like, shape (M,)
    Wanted radiation pressure P' [Pa].
weights : array_like, shape (M,)
    w [1/Pa2], >= 0.
energies : array_like, shape (L,), optional
    e [1/Pa2], >= 0. All 0 if left out.
wave : Wave, optional
    Default: 40 kHz at 20 degrees C.

Raises
------
InputError
    On sizes that do not fit, or a number that is not finite.

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> wanted = np.where(ball.normals[:, 2] < -0.9, 2.0, 0.0)
>>> problem = tf.RadiationProblem(tf.transfer(ball, array), tf.surface_slopes(ball), wanted, ball.areas)
)");
  kind.def(
          "__init__",
          [](SharedRadiation* self, const ArrayLike& h, const SlopesLike& slopes, const ArrayLike& wanted,
             const ArrayLike& weights, const ArrayLike& energies, const std::optional<Wave>& wave) {
            RadiationProblem problem =
                problem_of(h, slopes, wanted, weights, energies, bare_skin(wave_or_default(wave)));
            new (self) SharedRadiation(shared(SkinRadiation{std::move(problem), {}}));
          },
          nb::arg("h"), nb::arg("slopes"), nb::arg("wanted"), nb::arg("weights"), nb::arg("energies") = nb::none(),
          nb::arg("wave") = nb::none())
      .def_static(
          "of",
          [](const ArrayLike& h, const SharedTarget& target, double outside_weight, const std::optional<Wave>& wave,
             std::optional<int> threads) {
            return radiation_problem("RadiationProblem.of", h, target, outside_weight, wave, threads);
          },
          nb::arg("h"), nb::arg("target"), nb::arg("outside_weight") = MethodSpec{}.outside_weight,
          nb::arg("wave") = nb::none(), nb::arg("threads") = nb::none(),
          R"(The problem of a transfer matrix and a target.

Faces within a wavelength of the target count by their P, all skin outside the target by its energy too:

    (sum_j A_j (s_j (P_j - P'_j)^2 + (1 - s_j) P_j^2) / S + nu sum_i (1 - s_i) A_i abs(p_i)^2 / (4 rho c^2)) / (S A_T)

with P' = p'^2 / (4 rho c^2), S the largest P', s the shares of the faces in the target and A_T its area.

Parameters
----------
h : array_like of complex, shape (faces, N)
    Of every face of `target.mesh` [Pa].
target : Target
outside_weight : float
    nu, >= 0.
wave : Wave, optional
    That of H. Default: 40 kHz at 20 degrees C.
threads : int, optional

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 800)
>>> problem = tf.RadiationProblem.of(tf.transfer(ball, array), target)
>>> problem.radiation(tf.radiation(problem)).shape == problem.faces.shape
True
)")
      .def_static("of_model", &problem_of_model, nb::arg("model"), nb::arg("threads") = nb::none(),
                  R"(The problem of method `radiation` of a scene: of its first such method, or with the defaults.

Parameters
----------
model : Model
threads : int, optional

Returns
-------
RadiationProblem
    With it `radiation` finds what a run of the scene finds.

Examples
--------
>>> problem = tf.RadiationProblem.of_model(tf.Model("capsule"))
)");
  add_parts(kind);
  add_functions(kind);
  module.def("surface_slopes", &slopes_of_mesh, nb::arg("mesh"), nb::arg("wave") = nb::none(),
             nb::arg("threads") = nb::none(), R"(The gradient of a pressure along the skin, as a sparse matrix D.

Parameters
----------
mesh : Mesh
wave : Wave, optional
    Default: 40 kHz at 20 degrees C.
threads : int, optional

Returns
-------
tuple of ndarray
    (data, indices, indptr) of D, shape (2 faces, faces), which scipy.sparse.csr_array takes. Rows 2j and 2j + 1 are the
    slopes at face j along two directions in its plane, at right angles [1/m].

Examples
--------
>>> data, indices, indptr = tf.surface_slopes(tf.sphere(8e-3, 3e-3))
)");
}

}  // namespace touchfield::python
