#include "hardware/emission.h"

#include <utility>

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
