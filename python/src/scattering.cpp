#include <string>

#include <fmt/format.h>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/errors.h"
#include "sim/field/evaluate.h"
#include "sim/field/metrics.h"
#include "sim/mesh/query/clearance.h"
#include "sim/mesh/query/inspect.h"
#include "sim/model/clear_transducers.h"
#include "sim/run/skin_scattering.h"
#include "sim/run/transfer.h"

namespace touchfield::python {

namespace {

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

ComplexArray transfer(const SkinMesh& skin, const SharedArray& array, const std::optional<Wave>& wave,
                      const ArrayLike& faces, const std::string& scheme, const std::optional<std::string>& device,
                      std::optional<int> threads, const Callback& progress) {
  const Reporting reporting(progress);
  const SolverSpec spec = solver_spec("transfer", device);
  const int count = thread_count(threads);
  const auto mesh = skin.mesh;
  const Wave sound = wave_or_default(wave);
  const Scheme chosen = scheme_of_name("transfer", scheme);
  if (faces.is_none()) {
    return owned(computed(count, [=](Progress& task) {
      require_scatterer(*mesh, *array, "transfer");
      return transfer_matrix(*mesh, sound, *array, chosen, spec, task);
    }));
  }
  const auto rows = index_list(faces, "transfer: faces", mesh->face_count());
  return owned(computed(count, [=](Progress& task) {
    require_scatterer(*mesh, *array, "transfer");
    std::vector<SolveRecord> records;
    SkinScattering scattering(*mesh, sound, chosen, spec, *array, records, task,
                              static_cast<Eigen::Index>(rows.size()));
    return scattering.transfer_rows(rows, "transfer");
  }));
}

/// Pressures on the faces of a body for one drive or several, without H.
ComplexArray scatter(const SkinMesh& skin, const SharedArray& array, const DrivesLike& drives,
                     const std::optional<Wave>& wave, const std::string& scheme,
                     const std::optional<std::string>& device, std::optional<int> threads, const Callback& progress) {
  const Reporting reporting(progress);
  const SolverSpec spec = solver_spec("scatter", device);
  const Scheme chosen = scheme_of_name("scatter", scheme);
  const Eigen::MatrixXcd q = drive_columns(drives, "scatter: drives", array->size());
  const auto mesh = skin.mesh;
  Eigen::MatrixXcd found = computed(thread_count(threads), [=, sound = wave_or_default(wave)](Progress& task) {
    require_scatterer(*mesh, *array, "scatter");
    std::vector<SolveRecord> records;
    SkinScattering scattering(*mesh, sound, chosen, spec, *array, records, task, q.cols());
    Eigen::MatrixXcd pressure = scattering.pressure(q, "scatter");
    require_finite("scatter", pressure);
    return pressure;
  });
  return is_one_drive(drives) ? owned(Eigen::VectorXcd(found.col(0))) : owned(std::move(found));
}

/// H of a body and an array, by products: the solver of the body is kept.
class Operator {
 public:
  Operator(std::shared_ptr<SkinModel> model, TransducerArray array)
      : model_(std::move(model)), scattering_(model_, std::move(array), records_, silent_) {}

  std::shared_ptr<SkinModel> model() const { return model_; }

  Eigen::MatrixXcd product(const Eigen::MatrixXcd& drives) {
    Eigen::MatrixXcd pressure = scattering_.pressure(drives, "Scattering");
    records_.clear();
    require_finite("Scattering", pressure);
    return pressure;
  }

  /// H^H v, N x S.
  Eigen::MatrixXcd adjoint(const Eigen::MatrixXcd& v) {
    Eigen::MatrixXcd back = scattering_.weighted_rows(v.conjugate(), "Scattering").adjoint();
    records_.clear();
    require_finite("Scattering", back);
    return back;
  }

 private:
  std::shared_ptr<SkinModel> model_;
  std::vector<SolveRecord> records_;
  Progress silent_;  // as those of calls end with them
  SkinScattering scattering_;
};

/// What Python holds of it, and what it is made of.
struct SharedOperator {
  SkinMesh skin;
  SharedArray array;
  std::optional<Wave> wave;
  std::string scheme;
  std::optional<int> threads;
  std::shared_ptr<Operator> made{};

  nb::tuple parts() const { return nb::make_tuple(skin, array, wave, scheme, threads); }
};

/// Of the body of another where there is one.
SharedOperator scattering_of(SharedOperator parts, const Callback& progress,
                             const std::shared_ptr<Operator>& other = nullptr) {
  constexpr Eigen::Index kProducts = 100;  // that are expected
  const Reporting reporting(progress);
  const SolverSpec spec{.device = {.kind = ComputeDevice::Kind::kCpu}, .tolerance = 1e-6};
  parts.made = computed(thread_count(parts.threads),
                        [=, chosen = scheme_of_name("Scattering", parts.scheme), sound = wave_or_default(parts.wave),
                         mesh = parts.skin.mesh, array = parts.array](Progress& task) {
                          require_scatterer(*mesh, *array, "Scattering");
                          if (other != nullptr) {
                            return std::make_shared<Operator>(other->model(), *array);
                          }
                          auto model = std::make_shared<SkinModel>(*mesh, sound, chosen, spec, kProducts);
                          std::vector<SolveRecord> records;
                          SkinScattering(model, *array, records, task).prepare();
                          return std::make_shared<Operator>(std::move(model), *array);
                        });
  return parts;
}

/// H q, or the adjoint's product: one column or several.
///
/// size, of   as of drive_columns
template <auto product>
ComplexArray multiplied(const SharedOperator& self, const DrivesLike& values, const char* what, Eigen::Index size,
                        const char* of) {
  const Eigen::MatrixXcd columns = drive_columns(values, what, size, of);
  Eigen::MatrixXcd made = computed(thread_count(self.threads),
                                   [=, made = self.made](Progress&) { return std::invoke(product, *made, columns); });
  return is_one_drive(values) ? owned(Eigen::VectorXcd(made.col(0))) : owned(std::move(made));
}

ComplexArray pressures(const SharedOperator& self, const DrivesLike& drives) {
  return multiplied<&Operator::product>(self, drives, "Scattering: drives", self.array->size(), "per channel");
}

ComplexArray sent_back(const SharedOperator& self, const ArrayLike& v) {
  return multiplied<&Operator::adjoint>(self, v, "Scattering: v", self.skin.mesh->face_count(), "per face");
}

RealArray force(const SkinMesh& skin, const ArrayLike& pressure, const std::optional<Wave>& wave) {
  const Eigen::VectorXcd p = complex_list(pressure, "force: pressure");
  require_count("force: pressure", p.size(), skin.mesh->face_count(), "per face");
  return owned(computed(0, [=, mesh = skin.mesh, sound = wave_or_default(wave)](Progress&) {
    const Eigen::VectorXd inwards = radiation_pressure(SurfaceGradient(*mesh, sound.k()), sound, p);
    return Eigen::VectorXd(inwards.cwiseProduct(mesh->areas()));
  }));
}

ComplexArray field(const SkinMesh& skin, const SharedArray& array, const ArrayLike& pressure, const DrivesLike& drives,
                   const ArrayLike& points, const std::optional<Wave>& wave, std::optional<int> threads) {
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

void add_operator(nb::module_& module) {
  nb::class_<SharedOperator>(module, "Scattering", nb::type_slots(kOpenInit),

                             R"(H of `transfer` without its numbers: products by it and its adjoint.

It keeps the solver of the body. The first product by the adjoint also makes the field of every channel and keeps it: 32
bytes per face and channel. Each product solves once, on the processor, to a residual of 1e-6.
``scipy.sparse.linalg.aslinearoperator`` takes it.

Parameters
----------
mesh : Mesh
    A closed surface.
array : Array
wave, scheme, threads, progress
    As of `transfer`; `threads` is for all products.

Raises
------
InputError, NumericalError
    As `transfer`.

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> scattering = tf.Scattering(ball, array)
>>> pressure = scattering @ array.focus([0, 0, -8e-3])
>>> scattering.rmatvec(pressure).shape
(16,)
)")
      .def(
          "__init__",
          [](SharedOperator* self, const SkinMesh& mesh, const SharedArray& array, const std::optional<Wave>& wave,
             const std::string& scheme, std::optional<int> threads, const Callback& progress) {
            new (self) SharedOperator(scattering_of({mesh, array, wave, scheme, threads}, progress));
          },
          nb::arg("mesh"), nb::arg("array"), nb::arg("wave") = nb::none(), nb::kw_only(),
          nb::arg("scheme") = to_string(kDefaultScheme), nb::arg("threads") = nb::none(),
          nb::arg("progress") = nb::none())
      .def_prop_ro(
          "shape",
          [](const SharedOperator& self) { return nb::make_tuple(self.skin.mesh->face_count(), self.array->size()); },
          "(faces, channels).")
      .def_prop_ro(
          "dtype", [](const SharedOperator&) { return nb::module_::import_("numpy").attr("dtype")("complex128"); },
          "complex128.")
      .def("__matmul__", &pressures, nb::arg("drives").none())
      .def("matvec", &pressures, nb::arg("drives"), R"(H q, pressures on the skin; ``scattering @ drives`` is the same.

Parameters
----------
drives : array_like of complex, shape (N,) or (N, S), or Solution

Returns
-------
numpy.ndarray of complex, shape (M,) or (M, S)
    [Pa]

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> pressure = tf.Scattering(ball, array).matvec(np.ones(16))
)")
      .def("rmatvec", &sent_back, nb::arg("v"), R"(H^H v, the adjoint's product, by a transposed solve.

A cost L of the pressures p = H q has the gradient dL/d Re q + i dL/d Im q = H^H v, with v = dL/d Re p + i dL/d Im p.

Parameters
----------
v : array_like of complex, shape (M,) or (M, S)
    On every face.

Returns
-------
numpy.ndarray of complex, shape (N,) or (N, S)

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> back = tf.Scattering(ball, array).rmatvec(np.ones(len(ball)))
)")
      .def(
          "with_array",
          [](const SharedOperator& self, const SharedArray& array) {
            return scattering_of({self.skin, array, self.wave, self.scheme, self.threads}, nb::none(), self.made);
          },
          nb::arg("array"), R"(Of the same body with another array, or with this one moved: nothing is factorised again.

Parameters
----------
array : Array

Returns
-------
Scattering

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> scattering = tf.Scattering(ball, array)
>>> higher = scattering.with_array(tf.Array.grid(4, 4, at=[0, 0, -0.09]))
)")
      .def("__getstate__", &SharedOperator::parts)
      .def("__setstate__",
           [](SharedOperator& self, const nb::tuple& state) {
             new (&self)
                 SharedOperator(scattering_of({nb::cast<SkinMesh>(state[0]), nb::cast<SharedArray>(state[1]),
                                               nb::cast<std::optional<Wave>>(state[2]), nb::cast<std::string>(state[3]),
                                               nb::cast<std::optional<int>>(state[4])},
                                              nb::none()));
           })
      .def("__repr__", [](const SharedOperator& self) {
        return fmt::format("<touchfield.Scattering: {} faces, {} channels>", self.skin.mesh->face_count(),
                           self.array->size());
      });
}

}  // namespace

void add_scattering(nb::module_& module) {
  add_operator(module);
  module.def("transfer", &transfer, nb::arg("mesh"), nb::arg("array"), nb::arg("wave") = nb::none(), nb::kw_only(),
             nb::arg("faces") = nb::none(), nb::arg("scheme") = to_string(kDefaultScheme),
             nb::arg("device") = nb::none(), nb::arg("threads") = nb::none(), nb::arg("progress") = nb::none(),
             R"(The transfer matrix H: pressures on the skin are ``H @ drives``.

Parameters
----------
mesh : Mesh
    A closed surface.
array : Array
wave : Wave, optional
    Default: ``Wave()``.
faces : array_like of int, shape (K,), optional
    Rows that are wanted; default: all.
scheme : {"paper", "paper_corrected", "chief", "burton_miller", "burton_miller_polished"}
    Scheme of the boundary elements.
device : {"auto", "cpu", "cuda", "cuda:N"}, optional
threads : int, optional
    Default: OMP_NUM_THREADS, or all.
progress : callable or bool, optional
    A function of stage and fraction, or True for a bar.

Returns
-------
numpy.ndarray of complex, shape (M, N) or (K, N)
    Pressure of each channel at full drive on each face [Pa]. Your own, in Fortran order: PyTorch and JAX (with
    `jax_enable_x64`) take it by `from_dlpack` without a copy.

Raises
------
InputError
    On an open surface, or a transducer nearer than 1 mm to the skin.
NumericalError
    If a solution misses its tolerance.

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> tf.transfer(ball, array, faces=[0, 1]).shape
(2, 16)
)");
  module.def("scatter", &scatter, nb::arg("mesh"), nb::arg("array"), nb::arg("drives"), nb::arg("wave") = nb::none(),
             nb::kw_only(), nb::arg("scheme") = to_string(kDefaultScheme), nb::arg("device") = nb::none(),
             nb::arg("threads") = nb::none(), nb::arg("progress") = nb::none(),
             R"(The pressure of a drive vector on the skin, without the transfer matrix: one solve in place of many.

Parameters
----------
mesh : Mesh
    A closed surface.
array : Array
drives : array_like of complex, shape (N,) or (N, S), or Solution
    Amplitudes 0 to 1 and phases of the channels.
wave, scheme, device, threads, progress
    As of `transfer`.

Returns
-------
numpy.ndarray of complex, shape (M,) or (M, S)
    On every face [Pa].

Raises
------
InputError, NumericalError
    As `transfer`.

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> pressure = tf.scatter(ball, array, array.focus([0, 0, -8e-3]))
)");
  module.def("force", &force, nb::arg("mesh"), nb::arg("pressure"), nb::arg("wave") = nb::none(),
             R"(The acoustic radiation force on the skin.

Parameters
----------
mesh : Mesh
pressure : array_like of complex, shape (M,)
    On every face [Pa].
wave : Wave, optional
    Default: ``Wave()``.

Returns
-------
numpy.ndarray, shape (M,)
    Time-averaged force on each face along its inward normal [N].

Examples
--------
>>> ball = tf.sphere(8e-3, 3e-3)
>>> bool(np.isclose(tf.force(ball, np.ones(len(ball))).sum(), ball.areas.sum() / (4 * 1.2041 * 343.21**2)))
True
)");
  module.def("field", &field, nb::arg("mesh"), nb::arg("array"), nb::arg("pressure"), nb::arg("drives"),
             nb::arg("points"), nb::arg("wave") = nb::none(), nb::arg("threads") = nb::none(),
             R"(The pressure off the skin.

Parameters
----------
mesh : Mesh
array : Array
pressure : array_like of complex, shape (M,)
    On every face, of `scatter` or ``H @ drives`` [Pa].
drives : array_like of complex, shape (N,), or Solution
    That made it.
points : array_like, shape (J, 3)
    [m]
wave : Wave, optional
    Default: ``Wave()``.
threads : int, optional

Returns
-------
numpy.ndarray of complex, shape (J,)
    [Pa]; 0 inside the body, NaN on a transducer.

Examples
--------
>>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
>>> drives = array.focus([0, 0, -8e-3])
>>> beside = tf.field(ball, array, tf.scatter(ball, array, drives), drives, [[0, 0.02, 0]])
)");
}

}  // namespace touchfield::python
