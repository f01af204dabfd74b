#include "sim/run/felt.h"

#include <algorithm>
#include <nanobind/stl/pair.h>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "python/src/arrays.h"
#include "python/src/job.h"
#include "python/src/parts.h"
#include "sim/core/files.h"
#include "sim/jobs/felt_result.h"
#include "sim/run/felt_file.h"
#include "sim/scene/scene_reader.h"

namespace touchfield::python {

namespace {

using namespace nb::literals;

using SharedFelt = Shared<Felt>;

template <typename Whole>
SharedFelt felt_of_result(const Shared<Whole>& result, const std::vector<std::string>& changes) {
  return computed(0, [result, changes](Progress& progress) {
    const Scene scene = read_scene_text(result->scene, "", "", changes, "set");
    Felt felt = felt_of(*result, scene, scene.felt.value_or(FeltSpec{}));
    reference_of(felt);  // throws where the argument is none of the methods
    std::ranges::for_each(felt.warnings, [&](const std::string& warning) { progress.warn(warning); });
    return shared(std::move(felt));
  });
}

/// An object of Python's with these attributes.
template <typename... Named>
nb::object attributes(const Named&... named) {
  return nb::module_::import_("types").attr("SimpleNamespace")(named...);
}

nb::object maps_of(nb::handle_t<SharedFelt> self, const std::pair<std::string, std::string>& names) {
  const Felt& felt = *nb::cast<const SharedFelt&>(self);
  const auto skins = names_of(felt_skins(felt.spec));
  const auto method = std::ranges::find(felt.methods, names.first, &FeltMethod::name);
  const auto skin = std::ranges::find(skins, names.second);
  if (method == felt.methods.end() || skin == skins.end()) {
    const auto text = fmt::format("({}, {}) must be one of {} and one of {}", names.first, names.second,
                                  fmt::join(names_of(felt.methods), ", "), fmt::join(skins, ", "));
    throw nb::key_error(text.c_str());
  }
  const SkinVibration& found = method->skins[std::size_t(skin - skins.begin())];
  nb::dict energy, weighted;
  for (std::size_t d = 0; found.has_mechanics && d < kReceptorNames.size(); ++d) {
    energy[kReceptorNames[d]] = turned(found.energy[d], self);
  }
  for (std::size_t c = 0; c < kTouchChannels.size(); ++c) {
    weighted[channel_name(kTouchChannels[c]).c_str()] = turned(found.weighted[c], self);
  }
  return attributes("displacement"_a = turned(found.displacement, self), "velocity"_a = turned(found.velocity, self),
                    "energy"_a = energy, "weighted"_a = weighted, "hz"_a = view(method->lines.hz, self),
                    "spectrum"_a = turned(found.at_points, self));
}

nb::list points_of(const SharedFelt& felt) {
  nb::list points;
  for (const FeltPoint& point : felt->points) {
    points.append(attributes("name"_a = point.name, "at"_a = owned(Eigen::VectorXd(point.at)),
                             "place"_a = owned(Eigen::VectorXd(point.place))));
  }
  return points;
}

void save(const SharedFelt& felt, const PathLike& path, bool force) {
  do_work(0, [felt, place = path_of(path), force](Progress&) {
    require_free(place, force, "force=True replaces it");
    write_felt_file(place, *felt);
  });
}

Values skin_waves(const std::vector<std::pair<double, double>>& layers, bool on_bone, double tan_delta, double hz,
                  const ArrayLike& wavenumbers, const std::vector<double>& depths) {
  LayeredSkin skin{.layers = {}, .on_bone = on_bone, .tan_delta = tan_delta};
  for (const auto& [thickness, shear] : layers) {
    skin.layers.push_back({thickness, shear});
  }
  const Eigen::VectorXd k = real_list(wavenumbers, "skin_waves: wavenumbers");
  const auto waves = touchfield::skin_waves(skin, 2.0 * std::numbers::pi * hz, k, depths);
  nb::dict values;
  for (const auto& [name, part] : {std::pair("along", &SkinWaves::along), std::pair("inwards", &SkinWaves::inwards),
                                   std::pair("e_xx", &SkinWaves::e_xx), std::pair("e_zz", &SkinWaves::e_zz),
                                   std::pair("e_xz", &SkinWaves::e_xz)}) {
    Eigen::MatrixXcd rows(depths.size(), k.size());
    std::ranges::for_each(waves, [&, d = 0](const SkinWaves& wave) mutable { rows.row(d++) = wave.*part; });
    values[name] = owned(std::move(rows));
  }
  return values;
}

constexpr const char* kWavesText =
    R"(How layered skin moves under a pressure exp(i k x - i omega t), for who checks or replaces the mechanics.

Parameters
----------
layers, on_bone : list of (float, float), bool
    Thickness [m] and shear modulus at 200 Hz [Pa] from the surface; whether the last one ends at bone or nowhere.
tan_delta, hz, wavenumbers, depths : float, float, array_like, list of float
    Loss, frequency, K wavenumbers k [rad/m] and D depths [m].

Returns
-------
dict of str to numpy.ndarray of complex, shape (D, K)
    Displacements ``along`` x and ``inwards`` [m/Pa], strains ``e_xx``, ``e_zz`` and ``e_xz`` [1/Pa].

Examples
--------
>>> waves = tf.skin_waves([(4e-3, 30e3)], on_bone=True, tan_delta=0.4, hz=200, wavenumbers=[0, 500], depths=[0])
)";

}  // namespace

nb::object flat(const SkinPatch& patch, nb::handle owner) {
  return attributes("middle"_a = owned(Eigen::VectorXd(patch.middle)), "axes"_a = turned(patch.axes, owner),
                    "faces"_a = view(patch.faces, owner), "places"_a = turned(patch.places, owner),
                    "areas"_a = view(patch.areas, owner));
}

void add_felt(nb::module_& module) {
  nb::class_<SharedFelt>(module, "Felt", nb::dynamic_attr(),
                         R"(What the skin does under a result. ``felt[method, skin]`` has

    displacement, velocity   inwards, rms, maps with axes y and x of the patch from -12 to 12 mm [m, m/s]
    energy                   by receptor, sa1, ra, pc, at 0.3, 1.6, 2 mm, the mean strain energy density [J/m3]
    weighted                 by channel, p, ra, the displacement with lines weighted by thresholds; compare on one skin
    hz, spectrum             of the lines; complex peak at each of the points, shape (P, L) [m]

Maps are NaN off the patch. With the skin ``none`` the pressure stands for the displacement, in Pa instead of m.)")
      .def_prop_ro(
          "methods", [](const SharedFelt& self) { return names_of(self->methods); }, "Names of the methods.")
      .def_prop_ro(
          "skins", [](const SharedFelt& self) { return names_of(felt_skins(self->spec)); }, "Names of the skins.")
      .def_prop_ro("points", &points_of, "Of each point name, at, and place on the flat patch [m].")
      .def_prop_ro(
          "patch", [](nb::handle_t<SharedFelt> self) { return flat(nb::cast<const SharedFelt&>(self)->patch, self); },
          "The skin laid flat: middle, axes (rows x, y, normal), and of the evaluated skin "
          "faces, places (K, 2) and areas, in m.")
      .def_prop_ro(
          "warnings", [](const SharedFelt& self) { return self->warnings; }, "What makes maps unreliable.")
      .def("__getitem__", &maps_of)
      .def(
          "table",
          [](const SharedFelt& self, const std::optional<SharedFelt>& against) {
            return Rows(object_of(felt_value(*self, against ? std::optional(**against) : std::nullopt, "")["skins"]));
          },
          nb::arg("against") = nb::none(),
          R"(The rows of felt.csv as dicts. The dB are relative to the reference of `against`, a `Felt`, or of this one.

Examples
--------
>>> tf.run("capsule", set={"solve.methods": ["focus"]}).felt().table()[0]["p_db"]
0.0
)")
      .def("save", &save, nb::arg("path"), nb::arg("force") = false,
           R"(Writes a felt.h5 to `path`; `force` replaces an older one.

Examples
--------
>>> tf.run("capsule", set={"solve.methods": ["focus"]}).felt().save("felt.h5")
)")
      .def(
          "figure",
          [](const nb::object& self, const std::string& width) {
            return nb::module_::import_("touchfield._figures").attr("of_felt")(self, width);
          },
          nb::kw_only(), nb::arg("width") = "double",
          R"(P and the displacement of each skin, rms, for a paper: a `matplotlib.figure.Figure`.

A line is at half of the largest value, -6 dB. A column has one scale. `width` is "single" (85 mm) or "double" (175 mm).

Examples
--------
>>> tf.run("capsule", set={"solve.methods": ["focus"]}).felt().figure().savefig("felt.pdf")
)")
      .def("__repr__", [](const SharedFelt& self) { return felt_text(*self, std::nullopt); });
  module.def("_felt", &felt_of_result<Run>);
  module.def("_felt", &felt_of_result<Motion>);
  module.def("skin_waves", &skin_waves, nb::arg("layers"), nb::kw_only(), nb::arg("on_bone"), nb::arg("tan_delta"),
             nb::arg("hz"), nb::arg("wavenumbers"), nb::arg("depths"), kWavesText);
}

}  // namespace touchfield::python
