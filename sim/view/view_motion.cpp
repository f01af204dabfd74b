#include "sim/view/view_motion.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/field/surface_gradient.h"
#include "sim/model/model.h"
#include "sim/run/motion_summary.h"
#include "sim/scene/scene_reader.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

/// The least and the largest value of each of so many stretches and where it breaks, in the order of time; all values
/// if they are few.
void thin(ViewCurve& curve) {
  constexpr std::size_t kStretches = 1000;
  const std::size_t count = curve.values.size();
  if (count <= 2 * kStretches) {
    return;
  }
  ViewCurve thinned{curve.label, curve.line, {}, {}};
  for (std::size_t s = 0; s < kStretches; ++s) {
    const std::size_t begin = s * count / kStretches;
    const std::size_t end = (s + 1) * count / kStretches;
    std::size_t gap = end;
    std::size_t least = end;
    std::size_t largest = end;
    for (std::size_t i = begin; i < end; ++i) {
      const double value = curve.values[i];
      if (!std::isfinite(value)) {
        gap = std::min(gap, i);
        continue;
      }
      least = least == end || value < curve.values[least] ? i : least;
      largest = largest == end || value > curve.values[largest] ? i : largest;
    }
    for (const std::size_t i : std::set{gap, least, largest}) {
      if (i < end) {
        thinned.times.push_back(curve.times[i]);
        thinned.values.push_back(curve.values[i]);
      }
    }
  }
  curve = std::move(thinned);
}

/// Adds a line through records, unless it would have no finite value or zeros alone.
template <class Record, class TimeOf, class ValueOf>
void add_line(const std::string& label, const std::string& name, const std::vector<Record>& records,
              const TimeOf& time_of, const ValueOf& value_of, std::vector<ViewCurve>& curves) {
  ViewCurve line{label, name, {}, {}};
  std::ranges::transform(records, std::back_inserter(line.times), time_of);
  std::ranges::transform(records, std::back_inserter(line.values), value_of);
  if (std::ranges::any_of(line.values, [](double value) { return std::isfinite(value) && value != 0; })) {
    thin(line);
    curves.push_back(std::move(line));
  }
}

std::vector<ViewCurve> curves_of(const std::vector<MotionMethod>& methods) {
  std::vector<ViewCurve> curves;
  const auto of_scores = [&](const std::string& label, const std::function<double(const MotionScore&)>& value) {
    for (const MotionMethod& method : methods) {
      add_line(label, method.name, method.scores, &MotionScore::time, value, curves);
    }
  };
  const std::string mean = "mean |p| in target [Pa]";
  of_scores("error of |p| [%]", [](const MotionScore& score) { return 1e2 * score.metrics.relative_error; });
  for (const MotionMethod& method : methods) {
    std::vector<MotionScore> scores = method.scores;
    std::erase_if(scores, [](const MotionScore& score) {  // of a pattern P is known at its instants alone
      return std::isnan(score.metrics.relative_error_radiation) && !std::isnan(score.metrics.relative_error);
    });
    add_line(
        "error of P [%]", method.name, scores, &MotionScore::time,
        [](const MotionScore& score) { return 1e2 * score.metrics.relative_error_radiation; }, curves);
  }
  of_scores(mean, [](const MotionScore& score) { return score.metrics.mean_inside_pa; });
  if (!methods.empty()) {
    add_line(
        mean, "wanted", methods.front().scores, &MotionScore::time,
        [](const MotionScore& score) { return score.metrics.mean_inside_pa / score.metrics.reached_share; }, curves);
  }
  of_scores("displacement [mm]", [](const MotionScore& score) { return 1e3 * shown_displacement(score); });
  of_scores("age [ms]", [](const MotionScore& score) { return 1e3 * score.age; });
  for (const MotionMethod& method : methods) {
    add_line(
        "latency [ms]", method.name, method.frames, &MotionFrame::shown,
        [](const MotionFrame& frame) { return 1e3 * (frame.shown - frame.sampled); }, curves);
  }
  for (const MotionMethod& method : methods) {
    for (const auto& [place, pressure] : method.watched) {
      const double* value = pressure.data();
      add_line(
          "|p| at places [Pa]", place, method.scores, &MotionScore::time,
          [&](const MotionScore& /*score*/) { return *value++; }, curves);
    }
  }
  return curves;
}

/// As many as make a page of about kBytes, at least a strip's.
int most_skins(const Motion& motion) {
  constexpr double kBytes = 5e6;
  constexpr double kFewest = 6;
  constexpr double kOfVertex = 8;  // in base64
  constexpr double kOfFace = 6.7;  // |p|, phase and radiation pressure
  const TriangleMesh& mesh = evaluated_mesh(motion);
  const bool sensed =
      std::ranges::any_of(motion.instants, [](const auto& instant) { return instant.sensed.has_value(); });
  const double one = kOfVertex * static_cast<double>(mesh.vertex_count() + (sensed ? motion.mesh.vertex_count() : 0)) +
                     kOfFace * static_cast<double>(mesh.face_count()) * static_cast<double>(motion.methods.size());
  return static_cast<int>(std::max(kFewest, kBytes / one));
}

/// "error of P 41 %, median", or of |p| where that of P is not known.
std::string caption_of(const MotionMethod& method) {
  const MotionSummary over = summary(method);
  const double radiation = statistics_of(over, &Metrics::relative_error_radiation).median;
  const double error = std::isnan(radiation) ? statistics_of(over, &Metrics::relative_error).median : radiation;
  return std::isnan(error)
             ? ""
             : fmt::format("error of {} {:.1f} %, median", std::isnan(radiation) ? "|p|" : "P", 1e2 * error);
}

/// The sound of a motion; nothing if its scene cannot be read.
std::optional<Wave> wave_of(const Motion& motion) {
  try {
    const Scene scene = read_scene_text(motion.scene, "", "");
    return Wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

ViewData motion_view(const Motion& motion) {
  const std::optional<Wave> wave = wave_of(motion);
  ViewData data{.title = motion.name,
                .methods = {},
                .array = motion.array,
                .radiation_per_square = wave ? radiation_per_square(wave->medium()) : kNotComputed,
                .skins = {},
                .curves = curves_of(motion.methods)};
  for (const MotionMethod& method : motion.methods) {
    data.methods.push_back({method.name, caption_of(method)});
  }
  std::optional<SurfaceGradient> gradient;  // of the newest skin
  for (const MotionInstant& instant : some_instants(motion, most_skins(motion))) {
    if (wave && (!gradient || instant.mesh.vertices() != data.skins.back().mesh.vertices())) {
      gradient.emplace(instant.mesh, wave->k());
    }
    ViewSkin& skin = data.skins.emplace_back(
        ViewSkin{.time = instant.time, .mesh = instant.mesh, .sensed = instant.sensed, .target = instant.target});
    for (const auto& [method, pressure] : instant.pressure) {
      skin.pressure.push_back(pressure);
      if (wave) {
        skin.radiation.push_back(radiation_pressure(*gradient, *wave, pressure));
      }
    }
  }
  return data;
}

std::string motion_page(const Motion& motion, const std::string& picture, const std::string& results) {
  return view_page(motion_view(motion), picture, motion_report(motion, results));
}

}  // namespace touchfield
