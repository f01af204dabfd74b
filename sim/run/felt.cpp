#include "sim/run/felt.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/model/model.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

using Eigen::Index;

/// The pressure has no finer parts than twice the sound's; a quarter more for what bent skin does near edges.
double finest_of(const Scene& scene) {
  constexpr double kOfPatch = 1800.0;  // what the patch and its rim need, of low sounds [rad/m]
  return std::max(kOfPatch, 2.5 * Wave(build_medium(scene.medium, scene.frequency), scene.frequency).k());
}

/// The skin, its places, and what is to be said of them.
Felt begun(Scene scene, const FeltSpec& spec, const TriangleMesh& mesh, SkinPatch patch) {
  scene.felt = spec;
  Felt felt{.name = scene.name, .scene = resolved_yaml(scene), .spec = spec, .mesh = mesh, .patch = std::move(patch)};
  felt.points.push_back({"middle", felt.patch.middle, Eigen::Vector2d::Zero()});
  const FaceTree skin(mesh);
  for (std::size_t i = 0; i < spec.points.size(); ++i) {
    const SkinPoint at = skin.nearest(spec.points[i]);
    const std::optional<Eigen::Vector2d> place = felt.patch.place_of(mesh, at.at);
    require(place && at.distance < kOffSkin,
            "felt.points_mm[{}] = {} is not on the skin that is computed, {:g} mm about {}; give points on it, or "
            "felt.at_mm",
            i, place_text(spec.points[i]), 1e3 * SkinPatch::kReach, place_text(felt.patch.middle));
    felt.points.push_back({fmt::format("point{}", i + 1), at.at, *place});
  }
  return felt;
}

void add_method(const std::string& name, PressureLines lines, double finest, Felt& felt) {
  std::vector<Eigen::Vector2d> places;
  for (const FeltPoint& point : felt.points) {
    places.push_back(point.place);
  }
  FeltMethod method{.name = name, .lines = std::move(lines)};
  method.flattening = flattening_error(felt.patch, method.lines.mean_square().cwiseSqrt());
  method.skins = skin_vibrations(felt.patch, method.lines, felt_skins(felt.spec), finest, places);
  felt.methods.push_back(std::move(method));
}

void add_warnings(const std::optional<Target>& target, Felt& felt) {
  constexpr double kMostFlattened = 0.1;
  constexpr double kMostBeyond = 0.1;
  const auto worst = std::ranges::max_element(felt.methods, {}, &FeltMethod::flattening);
  if (worst->flattening > kMostFlattened) {
    felt.warnings.push_back(
        fmt::format("flattened: the skin about {} is bent: laid flat, lengths where {} presses change "
                    "by {:.0f} % (rms); read the maps as rough",
                    place_text(felt.patch.middle), worst->name, 100.0 * worst->flattening));
  }
  if (target) {
    const Eigen::VectorXd areas = target->areas(felt.mesh.areas());
    double within = 0.0;
    for (Index i = 0; i < target->size(); ++i) {
      within +=
          std::ranges::binary_search(felt.patch.faces, target->faces[static_cast<std::size_t>(i)]) ? areas(i) : 0.0;
    }
    if (within < (1.0 - kMostBeyond) * areas.sum()) {
      felt.warnings.push_back(
          fmt::format("beyond: {:.0f} % of the target's area is on the skin that is computed, {:g} mm about {}; "
                      "felt.at_mm moves it",
                      100.0 * within / areas.sum(), 1e3 * SkinPatch::kReach, place_text(felt.patch.middle)));
    }
  }
}

/// Frames that are shown too slowly for the lines that count.
void warn_of_steps(double rate, Felt& felt) {
  constexpr double kMost = 0.1;
  const PressureLines& lines = felt.methods.front().lines;
  double above = 0.0;
  double all = 0.0;
  for (std::size_t line = 0; line < lines.hz.size(); ++line) {
    const double square = lines.hz[line] * lines.hz[line] * lines.pressure.col(static_cast<Index>(line)).squaredNorm();
    all += square;
    above += lines.hz[line] >= 0.5 * rate ? square : 0.0;
  }
  if (above > kMost * all) {
    felt.warnings.push_back(fmt::format(
        "steps: {:.0f} % of what changes (rate of P, squared) is above half of {:g} frames per second: the steps from "
        "frame to frame; give pattern.frames_per_second more, or felt.highest_hz less",
        100.0 * above / all, rate));
  }
}

}  // namespace

Index felt_face(const TriangleMesh& mesh, const Vector3& at) {
  const SkinPoint nearest = FaceTree(mesh).nearest(at);
  require(nearest.distance < kOffSkin, "felt.at_mm = {} is {:.3g} mm off the skin; give a point on it", place_text(at),
          1e3 * nearest.distance);
  return nearest.face;
}

const FeltMethod& reference_of(const Felt& felt) {
  std::vector<std::string> names;
  std::ranges::transform(felt.methods, std::back_inserter(names), &FeltMethod::name);
  const auto named = std::ranges::find(names, felt.spec.reference.empty() ? names.front() : felt.spec.reference);
  require(named != names.end(), "felt.reference = {} must be one of {}", felt.spec.reference, fmt::join(names, ", "));
  return felt.methods[static_cast<std::size_t>(named - names.begin())];
}

std::vector<TissueModel> felt_skins(const FeltSpec& spec) {
  constexpr double kDermis = 1.5e-3;  // [m]
  constexpr double kMore = 10.0 / 3.0;
  std::vector<TissueModel> skins;
  for (const auto& [name, shear] :
       {std::pair("soft", spec.shear / 3.0), std::pair("middle", spec.shear), std::pair("stiff", spec.shear * kMore)}) {
    LayeredSkin skin{.layers = {{spec.bone, shear}}, .on_bone = true, .tan_delta = spec.tan_delta};
    if (spec.layers != FeltSpec::Layers::kOnBone) {
      skin.on_bone = false;
      if (spec.layers == FeltSpec::Layers::kDermisOnFat) {
        skin.layers = {{kDermis, shear * kMore}, {kDermis, shear / 3.0}};
      }
    }
    skins.push_back({name, skin});
  }
  skins.push_back({"none", std::nullopt});
  return skins;
}

Eigen::VectorXd map_on_skin(const Felt& felt, const Eigen::MatrixXd& map) {
  Eigen::VectorXd values = Eigen::VectorXd::Constant(felt.mesh.face_count(), kNotComputed);
  for (Index i = 0; i < felt.patch.size(); ++i) {
    values(felt.patch.faces[static_cast<std::size_t>(i)]) = map_at(map, felt.patch.places.col(i));
  }
  return values;
}

Eigen::VectorXd radiation_on_skin(const Felt& felt, const FeltMethod& method) {
  Eigen::VectorXd values = Eigen::VectorXd::Constant(felt.mesh.face_count(), kNotComputed);
  values(felt.patch.faces) = method.lines.mean_square().cwiseSqrt();
  return values;
}

FeltFigures felt_figures(const Felt& felt, const SkinVibration& skin) {
  FeltFigures figures;
  const double moved = largest(skin.displacement);
  figures.displacement_um = skin.has_mechanics ? 1e6 * moved : kNotComputed;
  figures.pressure_pa = skin.has_mechanics ? kNotComputed : moved;
  figures.velocity_mm_s = skin.has_mechanics ? 1e3 * largest(skin.velocity) : kNotComputed;
  figures.spread_mm2 = 1e6 * half_area(skin.displacement);
  for (std::size_t d = 0; d < skin.energy.size(); ++d) {
    figures.energy_j_m3[d] = skin.has_mechanics ? largest(skin.energy[d]) : kNotComputed;
  }
  for (std::size_t c = 0; c < skin.weighted.size(); ++c) {
    figures.weighted[c] = largest(skin.weighted[c]);
  }
  figures.dip_db = felt.spec.points.size() < 2
                       ? kNotComputed
                       : 20.0 * std::log10(dip_between(skin.displacement, felt.points[1].place, felt.points[2].place));
  return figures;
}

Felt felt_of(const Run& run, const Scene& scene, const FeltSpec& spec) {
  const TriangleMesh& mesh = evaluated_mesh(run);
  const std::optional<Target>& target = run.evaluation_model ? run.evaluation_model->target : run.target;
  require(spec.at || target, "felt: the run has no target; give felt.at_mm, a place on the skin");
  require(std::ranges::any_of(run.methods, [](const MethodResult& method) { return method.radiation.size() > 0; }),
          "felt: no method of {} was evaluated, so its radiation pressure is not known", run.name);
  const Index face = spec.at ? felt_face(mesh, *spec.at) : central_face(mesh, *target);
  Felt felt = begun(scene, spec, mesh, skin_patch(mesh, face));
  felt.provenance = run.provenance;
  for (const MethodResult& method : run.methods) {
    if (method.radiation.size() > 0) {
      const Eigen::VectorXd radiation = method.radiation(felt.patch.faces);
      add_method(method.name, modulated_lines(radiation, spec.modulation_hz), finest_of(scene), felt);
    }
  }
  add_warnings(target, felt);
  return felt;
}

Felt felt_of(const Motion& motion, const Scene& scene, const FeltSpec& spec) {
  require(motion.patch.has_value(),
          "felt: {} does not hold the radiation pressure of every frame: it is a motion, or a pattern of an earlier "
          "version; `touchfield pattern` writes it",
          motion.name);
  const MotionPatch& patch = *motion.patch;
  require(
      !spec.at || felt_face(evaluated_mesh(motion), *spec.at) == patch.skin.face,
      "felt.at_mm = {} is not the middle of the skin that the pattern has kept, {}; solve the pattern with this key",
      place_text(*spec.at), place_text(patch.skin.middle));
  Felt felt = begun(scene, spec, evaluated_mesh(motion), patch.skin);
  felt.provenance = motion.provenance;
  for (const auto& [name, at] : patch.points) {
    if (const auto place = felt.patch.place_of(felt.mesh, at)) {
      felt.points.push_back({name, at, *place});
    } else {
      felt.warnings.push_back(
          fmt::format("beyond: {} of the pattern is not on the skin that is computed, {:g} mm about "
                      "{}; felt.at_mm moves it",
                      name, 1e3 * SkinPatch::kReach, place_text(felt.patch.middle)));
    }
  }
  constexpr double kMostLines = 10'000;
  const double rate = spec.frames_hz.value_or(patch.rate);
  const double spacing = rate / static_cast<double>(patch.radiation.cols());
  require(spec.highest_hz <= kMostLines * spacing,
          "felt.highest_hz = {:g}: a pattern that repeats after {:g} s has more than {:g} lines up to it; give less",
          spec.highest_hz, 1.0 / spacing, kMostLines);
  PressureLines lines = frame_lines(patch.radiation, rate, spec.highest_hz);
  require(!lines.hz.empty(), "felt: the pattern has no line up to felt.highest_hz = {:g}; its first is at {:g} Hz",
          spec.highest_hz, spacing);
  add_method(motion.methods.front().name, std::move(lines), finest_of(scene), felt);
  warn_of_steps(rate, felt);
  add_warnings(std::nullopt, felt);
  return felt;
}

}  // namespace touchfield
