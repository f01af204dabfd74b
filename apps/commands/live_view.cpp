#include "apps/commands/live_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/field/metrics.h"
#include "sim/field/surface_gradient.h"
#include "sim/view/page_values.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

constexpr std::chrono::seconds kAgain{1};  // what has not changed is said, to pages that were loaded since

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

/// Whether the array sounds as far as is known, or why not.
///
/// sounds   null: nothing was played yet
const char* state_of(const MotionFrame& frame, const bool* sounds) {
  if (sounds == nullptr) {
    return "nothing was played yet";
  }
  if (*sounds) {
    return "playing";
  }
  return frame.lost     ? "silent, the sensor does not know where the hand is"
         : frame.silent ? "silent, no skin in the target"
                        : "silent, data are too old";
}

}  // namespace

LiveView::LiveView(int port)
    : id_(std::to_string(std::chrono::system_clock::now().time_since_epoch().count())), server_(port) {}

bool LiveView::wants_skin() {
  const Clock::time_point now = Clock::now();
  if (!server_.watched() || now < wanted_) {
    return false;
  }
  wanted_ = std::max<Clock::time_point>(wanted_ + ViewServer::kApart, now);
  return true;
}

void LiveView::begin(const LiveLoop& loop, const std::string& name, const MethodSpec& method, const LiveSolution& first,
                     bool emits) {
  const Model& model = first.skin->model;
  const ViewData data{
      .title = fmt::format("{}: live{}", name, emits ? "" : ", a rehearsal without a device"),
      .methods = {{method.name}},
      .array = model.fixed->array,
      .radiation_per_square = method.kind->radiation ? radiation_per_square(model.fixed->wave.medium()) : kNotComputed,
      .skins = {view_skin(*first.skin, 0, method.kind->radiation)}};
  per_square_ = data.radiation_per_square;
  scale_colours(data.skins.front());
  server_.start({view_page(data, "", "", id_), [this, &loop] { return next(loop); }});
}

void LiveView::scale_colours(const ViewSkin& skin) {
  if (!scaled_) {
    tops_ = tops_json({skin}, per_square_);
    scaled_ = skin.target.has_value();
  }
}

std::optional<std::string> LiveView::next(const LiveLoop& loop) {
  const auto newest = loop.newest();
  const auto played = played_.newest();
  const Clock::time_point now = Clock::now();
  if (!newest || (frame_ == newest->number && played_told_ == played && now < told_ + kAgain)) {
    return std::nullopt;
  }
  told_ = now;
  played_told_ = played;
  const MotionFrame& frame = newest->frame;
  Json strips = Json::object();
  Json said = {{"live", id_}, {"time", newest->solved}};
  if (std::exchange(frame_, newest->number) != newest->number) {
    strips = {{"from the sample to the link [ms]", 1e3 * (played ? played->age : kNotComputed)},
              {"solving [ms]", 1e3 * (newest->solved - frame.started)},
              {"dropped frames", newest->dropped}};
  }
  const auto seen = loop.newest_skin();
  if (seen && std::exchange(skin_, seen->number) != seen->number) {
    const bool radiation = !std::isnan(per_square_);
    const ViewSkin skin = view_skin(*seen->skin, seen->frame.pose_time, radiation);
    scale_colours(skin);
    said["skin"] = skin_json(skin);
    strips[fmt::format("error of {} on the skin as sensed [%]", radiation ? "P" : "|p|")] =
        error_percent(skin, seen->skin->model.boxes);
  }
  const PlayReport so_far = played ? played->so_far : PlayReport{};
  said["tops"] = tops_;
  said["strips"] = strips;
  said["sounds"] = played && played->sounds;
  said["state"] = fmt::format("frame {} at {:.1f} s: {}; {} frames sent, {} late, {} dropped, {} too old, {} silences",
                              newest->number, newest->solved, state_of(frame, played ? &played->sounds : nullptr),
                              so_far.sent, newest->late, newest->dropped, so_far.stale, so_far.silences);
  return json_text(said);
}

}  // namespace touchfield
