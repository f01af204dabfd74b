#include "apps/commands/live_view.h"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/json.h"
#include "sim/core/units.h"
#include "sim/field/metrics.h"
#include "sim/view/page_values.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

ViewSkin view_skin(const SolvedSkin& solved, double time) {
  ViewSkin skin{.time = time, .mesh = solved.model.body.mesh, .pressure = {solved.pressure}};
  if (presses(solved.model)) {
    skin.target = build_target(solved.model);
    skin.target->amplitudes *= solved.scale;
  }
  return skin;
}

/// On the skin as the solver saw it [%]; NaN where it is not known.
double error_percent(const ViewSkin& skin, const Model& model, const MethodSpec& method) {
  if (!skin.target || skin.pressure.front().size() == 0) {
    return kNotComputed;
  }
  const auto metrics = [&] {
    return method.kind->radiation
               ? metrics_of(skin.mesh, model.fixed->wave, model.boxes, *skin.target, skin.pressure.front())
               : pattern_metrics(skin.mesh, model.boxes, *skin.target, skin.pressure.front());
  }();
  return 100 * (method.kind->radiation ? metrics.relative_error_radiation : metrics.relative_error);
}

double per_square(const Model& model) { return radiation_per_square(model.fixed->wave.medium()); }

}  // namespace

void LiveView::begin(const LiveLoop& loop, const SensedMotion& sensed, const MethodSpec& method,
                     const LiveSolution& first, bool emits) {
  const Model& model = first.skin->model;
  ViewData data{.title = fmt::format("{}: live{}", sensed.scene.name, emits ? "" : ", a rehearsal without a device"),
                .methods = {{method.name}},
                .array = model.fixed->array,
                .radiation_per_square = per_square(model),
                .skins = {view_skin(*first.skin, 0)}};
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
    const ViewSkin skin = view_skin(*newest->skin, frame.pose_time);
    said["skin"] = skin_json(skin, per_square(newest->skin->model));
    strips["error on the skin as sensed [%]"] = error_percent(skin, newest->skin->model, method);
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
