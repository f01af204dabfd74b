#include "hardware/emission.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "hardware/array_match.h"
#include "hardware/guard/guarded_link.h"
#include "hardware/make_link.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"

namespace touchfield {

namespace {

Modulation modulation_of(const DeviceChoice& device, const LinkAbilities& abilities) {
  if (device.samples) {
    return SampledModulation{*device.samples, abilities.modulation.rate};
  }
  if (device.frequency) {
    return SineModulation{*device.frequency, device.depth};
  }
  return StaticModulation{};
}

/// The frames of a plan, rounded for a device, and what that did to them.
struct RoundedFrames {
  std::vector<DriveFrame> frames;
  QuantisationReport report;
};

RoundedFrames rounded_frames(const std::vector<Drive>& drives, double level, const ArrayLink& link) {
  RoundedFrames rounded;
  rounded.report.steps = link.abilities().steps;
  for (const Drive& drive : drives) {
    QuantisedDrive quantised = quantise(drive.phases, drive.amplitudes, level, link.abilities().steps, link.describe());
    require_fits(quantised.frame, link.abilities(), static_cast<std::size_t>(link.layout().positions.cols()),
                 link.describe());
    rounded.frames.push_back(std::move(quantised.frame));
    rounded.report.add(quantised.report);
  }
  return rounded;
}

// Plays through a guarded link and leaves the array quiet.
void play_guarded(const EmissionPlan& plan, const std::vector<DriveFrame>& frames, const Modulation& modulation,
                  ArrayLink& link, StopSignals& signals, EmissionReport& report) {
  const auto source = [&](std::size_t n) { return frames[n]; };
  const auto observer = [&](std::size_t n, const DriveFrame& frame) {
    if (report.read_back) {
      require_read_back(frame, link);
    }
    if (plan.observer) {
      plan.observer(n, frame);
    }
  };
  SignalledPace pace(signals);
  try {
    link.open();
    link.set_modulation(modulation);
    report.read_back = link.abilities().reads_back;
    if (report.read_back) {
      require_read_back(modulation, link);
    }
    report.play = play(frames.size(), source, link, {report.rate, report.seconds, plan.request.repeat}, pace, observer);
    link.quiet();
    report.quiet = true;
    link.close();
  } catch (const DeviceError&) {
    // A signal to both processes makes the guard stop by itself, and it has told so.
    constexpr double kSignalPatience = 0.1;
    if (!signals.wait(kSignalPatience)) {
      throw;
    }
  }
  report.signal = signals.signal();
}

}  // namespace

double permitted_level(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device) {
  if (!(request.most_level > 0 && request.most_level <= 1)) {
    throw InputError(fmt::format("--max-level = {} must be > 0 and <= 1", request.most_level));
  }
  const bool fixed = abilities.steps.intensity_levels == 2;
  const double level = request.level.value_or(fixed ? 1.0 : std::min(kUsualLevel, request.most_level));
  if (!(level > 0 && level <= 1)) {
    throw InputError(fmt::format("--level = {} must be > 0 and <= 1", level));
  }
  if (fixed && level != 1) {
    throw InputError(
        fmt::format("--level = {}: {} drives its transducers fully or not at all, level 1; its supply "
                    "voltage sets the pressure",
                    level, device));
  }
  if (level > request.most_level) {
    throw InputError(fmt::format("level = {} must be <= {}{}; --max-level raises the cap", level, request.most_level,
                                 fixed ? fmt::format(" and {} has no other", device) : ""));
  }
  return level;
}

double permitted_seconds(const EmissionRequest& request, std::size_t frames) {
  const double most = request.most_seconds;
  if (!(most > 0) || !std::isfinite(most)) {
    throw InputError(fmt::format("--max-seconds = {} must be > 0 and finite", most));
  }
  const double once = frames == 1 ? kOneFrameSeconds : static_cast<double>(frames) / request.rate;
  const double seconds = request.seconds.value_or(once);
  if (!(seconds > 0) || !std::isfinite(seconds)) {
    throw InputError(fmt::format("--seconds = {} must be > 0 and finite", seconds));
  }
  if (seconds > most) {
    throw InputError(fmt::format("{:g} s of emission must be <= {:g} s; --max-seconds raises the cap", seconds, most));
  }
  return seconds;
}

double permitted_rate(const EmissionRequest& request, const LinkAbilities& abilities, const std::string& device) {
  const double most = abilities.most_frames_per_second;
  if (!(request.rate > 0 && request.rate <= most)) {
    throw InputError(
        fmt::format("{:g} frames a second must be > 0 and <= {:g}, what {} carries", request.rate, most, device));
  }
  return request.rate;
}

void require_read_back(const DriveFrame& sent, ArrayLink& link) {
  const std::optional<DriveFrame> held = link.read_back();
  if (!held || *held == sent) {
    return;
  }
  std::size_t n = 0;
  while (n < sent.size() && n < held->size() && sent.phase[n] == held->phase[n] &&
         sent.intensity[n] == held->intensity[n]) {
    ++n;
  }
  throw DeviceError(
      fmt::format("{}: it reads back another pattern than was sent, from transducer {} on", link.describe(), n));
}

void require_read_back(const Modulation& sent, ArrayLink& link) {
  const std::optional<std::vector<std::uint8_t>> held = link.read_back_modulation();
  if (!held) {
    return;
  }
  const std::vector<std::uint8_t> wanted = modulation_samples(sent, link.abilities().modulation);
  bool same = !held->empty() && held->size() % wanted.size() == 0;
  for (std::size_t k = 0; same && k < held->size(); ++k) {
    same = (*held)[k] == wanted[k % wanted.size()];
  }
  if (!same) {
    throw DeviceError(fmt::format("{}: it reads back another modulation than was sent", link.describe()));
  }
}

ArrayLayout layout_of(const TransducerArray& array) {
  return {array.positions, array.axes, array.device, array.channel};
}

std::unique_ptr<ArrayLink> local_link(const DeviceChoice& device, const ArrayLayout& array, std::size_t frames) {
  return make_link({device.link, device.library, array, frames, device.replace});
}

EmissionReport emit(const EmissionPlan& plan) {
  EmissionReport report;
  report.link = plan.device.link;
  const LinkAddress address = parse_link_address(plan.device.link);
  report.dry = address.kind == LinkAddress::Kind::kDryRun;
  // Before a library can start threads of its own, which would take the signals.
  std::optional<StopSignals> signals;
  if (plan.emit && !report.dry) {
    signals.emplace();
  }
  const std::unique_ptr<ArrayLink> local = local_link(plan.device, plan.array);
  report.device = local->describe();
  const LinkAbilities abilities = local->abilities();
  for (const TransducerArray& array : plan.must_match) {
    require_match(array, local->layout(), report.device);
  }
  report.transducers = static_cast<std::size_t>(local->layout().positions.cols());
  report.level = permitted_level(plan.request, abilities, report.device);
  report.rate = permitted_rate(plan.request, abilities, report.device);
  const Modulation modulation = modulation_of(plan.device, abilities);
  require_ability(modulation, abilities.modulation, report.device);
  report.modulation = describe(modulation, abilities.modulation);
  const RoundedFrames rounded = rounded_frames(plan.drives(local->layout()), report.level, *local);
  report.frames = rounded.frames.size();
  report.quantisation = rounded.report;
  report.seconds = permitted_seconds(plan.request, report.frames);
  if (report.dry) {
    const std::unique_ptr<ArrayLink> writer = local_link(plan.device, plan.array, report.frames);
    writer->open();
    for (const DriveFrame& frame : rounded.frames) {
      writer->send(frame);
    }
    report.written = address.path.empty() ? 0 : report.frames;
  } else if (signals) {
    GuardedLink link(plan.watchdog, {plan.device.link, plan.device.library, plan.array, report.frames, false},
                     {report.level, report.seconds});
    report.emitted = true;
    play_guarded(plan, rounded.frames, modulation, link, *signals, report);
  }
  return report;
}

}  // namespace touchfield
