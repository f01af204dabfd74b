#include "apps/commands/live_view.h"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/json.h"
#include "sim/core/units.h"
#include "sim/field/metrics.h"
#include "sim/field/surface_gradient.h"
#include "sim/view/page_values.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

/// With the radiation pressure of a method that works on it; it takes longer than all else of a frame.
ViewSkin view_skin(const SolvedSkin& solved, double time, bool radiation) {
  ViewSkin skin{.time = time, .mesh = solved.model.body.mesh, .pressure = {solved.pressure}};
  if (presses(solved.model)) {
    skin.target = build_target(solved.model);
    skin.target->amplitudes *= solved.scale;
  }
  if (radiation && solved.pressure.size() != 0) {
    const Wave& wave = solved.model.fixed->wave;
    skin.radiation = {radiation_pressure(SurfaceGradient(skin.mesh, wave.k()), wave, solved.pressure)};
  }
  return skin;
}

/// On the skin as the solver saw it [%], of the radiation pressure where it is there; NaN where it is not known.
double error_percent(const ViewSkin& skin, const std::vector<TargetBox>& boxes) {
  if (!skin.target || skin.pressure.front().size() == 0) {
    return kNotComputed;
  }
  const Eigen::VectorXcd& pressure = skin.pressure.front();
  return 100 *
         (skin.radiation.empty()
              ? pattern_metrics(skin.mesh, boxes, *skin.target, pressure).relative_error
              : metrics_of(skin.mesh, boxes, *skin.target, pressure, skin.radiation.front()).relative_error_radiation);
}

}  // namespace

void LiveView::begin(const LiveLoop& loop, const SensedMotion& sensed, const MethodSpec& method,
                     const LiveSolution& first, bool emits) {
  const Model& model = first.skin->model;
  const bool radiation = method.kind->radiation;
  ViewData data{.title = fmt::format("{}: live{}", sensed.scene.name, emits ? "" : ", a rehearsal without a device"),
                .methods = {{method.name}},
                .array = model.fixed->array,
                .radiation_per_square = radiation ? radiation_per_square(model.fixed->wave.medium()) : kNotComputed,
                .skins = {view_skin(*first.skin, 0, radiation)}};
  server_.start({view_page(data, "", "", true), [this, &loop, &sensed, method] { return next(loop, sensed, method); }});
}

std::optional<std::string> LiveView::next(const LiveLoop& loop, const SensedMotion& sensed, const MethodSpec& method) {
  const std::shared_ptr<const LiveFrame> newest = loop.newest();
  if (!newest || told_ == newest->number) {
    return std::nullopt;
  }
  told_ = newest->number;
  const MotionFrame& frame = newest->frame;
  const auto played = played_.newest();
  const PlayReport so_far = played ? played->so_far : PlayReport{};
  Json strips = {{"from the sample to the link [ms]", 1e3 * (played ? played->age : kNotComputed)},
                 {"solving [ms]", 1e3 * (newest->solved - frame.started)},
                 {"dropped frames", newest->dropped}};
  Json said = {{"time", newest->solved}};
  if (newest->skin) {
    const ViewSkin skin = view_skin(*newest->skin, frame.pose_time, method.kind->radiation);
    said["skin"] = skin_json(skin);
    strips["error on the skin as sensed [%]"] = error_percent(skin, newest->skin->model.boxes);
  }
  if (sensed.truth && !frame.silent) {
    strips["target from its true place [mm]"] = target_off(*sensed.truth, frame) / kMillimetre;
  }
  const bool sounds = played && played->sounds;
  const char* state = frame.lost     ? "silent, the sensor does not know where the hand is"
                      : frame.silent ? "silent, no skin in the target"
                      : sounds       ? "playing"
                                     : "silent, data are too old";
  said["strips"] = strips;
  said["state"] = fmt::format("frame {} at {:.1f} s: {}; {} frames sent, {} late, {} dropped, {} too old, {} silences",
                              newest->number, newest->solved, state, so_far.sent, newest->late, newest->dropped,
                              so_far.stale, so_far.silences);
  return json_text(said);
}

}  // namespace touchfield
