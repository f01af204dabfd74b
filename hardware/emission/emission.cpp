#include "hardware/emission/emission.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "hardware/array_match.h"
#include "hardware/guard/guarded_link.h"
#include "hardware/links/dry_run_link.h"
#include "hardware/links/make_link.h"
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

/// Plays to a link and leaves it silent.
using Playing = std::function<void(ArrayLink& link, Pace& pace, const FrameObserver& observer)>;

Gaps worst(const Gaps& a, const Gaps& b) { return {std::max(a.count, b.count), std::max(a.longest, b.longest)}; }

// Plays through a guarded link.
void play_guarded(const EmissionPlan& plan, const Playing& playing, const Modulation& modulation, GuardedLink& link,
                  StopSignals& signals, EmissionReport& report) {
  std::optional<SignalledPace> pace;
  try {
    link.open();
    link.set_modulation(modulation);
    pace.emplace(signals, true);
    playing(link, *pace, plan.observer);
    report.silent = true;
    pace->end();
    if (pace->overslept()) {
      throw DeviceError(fmt::format("this program {}; the array is silent", pace->attention().fault()));
    }
  } catch (const DeviceError&) {
    if (pace) {
      pace->end();
    }
    // A signal to both processes makes the guard stop by itself, and it has told so.
    constexpr double kSignalPatience = 0.1;
    if (!signals.wait(kSignalPatience) || !link.has_told()) {
      if (!pace) {
        throw;
      }
      report.failure = std::current_exception();
    }
  }
  link.close();
  if (pace) {
    report.gaps = worst(pace->attention().gaps(), link.gaps());
  }
}

// throws   InputError if one of the files of a dry run is one that is read, by whatever name
void require_unread(const DryRunFiles& files, const std::vector<std::string>& read) {
  for (std::size_t frame = 0; frame < files.frames && !files.file.empty(); ++frame) {
    for (const std::string& input : read) {
      std::error_code error;
      if (std::filesystem::equivalent(files.of(frame), input, error)) {
        throw InputError(fmt::format("dry-run: {} is the same file as {}, which is read; give another file to write",
                                     files.of(frame), input));
      }
    }
  }
}

// What is done without a device: a stream is played all the same, and a dry run writes its files.
void play_dry(const EmissionPlan& plan, const std::vector<DriveFrame>& frames, const Playing& playing,
              const ArrayLink& device, EmissionReport& report) {
  // Between two frames of a stream there may be a silent one.
  const auto most = static_cast<std::size_t>(2 * std::ceil(report.seconds * report.rate)) + 1;
  const std::size_t count = plan.stream ? most : frames.size();
  require_unread({parse_link_address(plan.device.link).path, count}, plan.read);
  const std::unique_ptr<ArrayLink> writer =
      report.dry ? local_link(plan.device, plan.array, count)
                 : std::make_unique<DryRunLink>(device.layout(), device.abilities().steps.phase_levels, DryRunFiles{});
  writer->open();
  if (plan.stream) {
    SignalledPace pace(*plan.signals, false);
    playing(*writer, pace, plan.observer);
    report.gaps = pace.attention().gaps();
  } else {
    for (const DriveFrame& frame : frames) {
      writer->send(frame);
    }
  }
  if (report.dry && !parse_link_address(plan.device.link).path.empty()) {
    report.written = plan.stream ? report.play.sent + report.play.silences : frames.size();
  }
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
        fmt::format("{:g} frames per second must be > 0 and <= {:g}, the limit of {}", request.rate, most, device));
  }
  return request.rate;
}

ArrayLayout layout_of(const TransducerArray& array) {
  return {array.positions, array.axes, array.device, array.channel};
}

std::unique_ptr<ArrayLink> local_link(const DeviceChoice& device, const ArrayLayout& array, std::size_t frames) {
  return make_link({device.link, array, frames, device.replace});
}

EmissionReport emit(const EmissionPlan& plan) {
  EmissionReport report;
  report.link = plan.device.link;
  report.dry = parse_link_address(plan.device.link).kind == LinkAddress::Kind::kDryRun;
  std::optional<StopSignals> own;
  StopSignals* signals = plan.signals;
  if (signals == nullptr && plan.emit && !report.dry) {
    signals = &own.emplace();
  }
  const std::unique_ptr<ArrayLink> local = local_link(plan.device, plan.array);
  report.device = local->describe();
  const LinkAbilities abilities = local->abilities();
  for (const TransducerArray& array : plan.must_match) {
    require_match(array, local->layout(), report.device);
  }
  report.transducers = static_cast<std::size_t>(local->layout().positions.cols());
  report.level = permitted_level(plan.request, abilities, report.device);
  report.rate = plan.request.stored ? plan.request.rate : permitted_rate(plan.request, abilities, report.device);
  const Modulation modulation = modulation_of(plan.device, abilities);
  require_ability(modulation, abilities.modulation, report.device);
  report.modulation = describe(modulation, abilities.modulation);
  report.quantisation.steps = abilities.steps;
  if (plan.stream) {
    report.seconds = permitted_seconds(plan.request, 1);
  }
  const Rounding rounded = [&](const Drive& drive) {
    QuantisedDrive quantised = quantise(drive.phases, drive.amplitudes, report.level, abilities.steps, report.device);
    require_fits(quantised.frame, abilities, report.transducers, report.device);
    report.quantisation.add(quantised.report);
    return std::move(quantised.frame);
  };
  std::vector<DriveFrame> frames;
  for (const Drive& drive : plan.drives(local->layout())) {
    frames.push_back(rounded(drive));
  }
  if (!plan.stream) {
    report.frames = frames.size();
    if (plan.request.stored) {
      stored_periods(report.frames, report.rate, abilities.stored, report.device);
    }
    report.seconds = permitted_seconds(plan.request, report.frames);
  }
  const Playing playing = [&](ArrayLink& link, Pace& pace, const FrameObserver& observer) {
    if (plan.stream) {
      play(plan.stream(rounded), link, report.seconds, pace, report.play, observer);
      return;
    }
    const PlayOptions options{report.rate, report.seconds, plan.request.repeat};
    if (plan.request.stored) {
      play_stored(frames, link, options, pace, report.play);
      link.silence();
      return;
    }
    const auto source = [&](std::size_t n) { return frames[n]; };
    play(frames.size(), source, link, options, pace, report.play, observer);
    link.silence();
  };
  if (plan.emit && !report.dry) {
    if (abilities.switches_off_after == 0) {
      std::fputs(fmt::format("touchfield: note: {} has no timer: if this program and its guard fail at once, it keeps "
                             "its last frame until its supply is switched off\n",
                             report.device)
                     .c_str(),
                 stderr);
    }
    GuardedLink link(plan.guard, {plan.device.link, plan.array, report.frames, false}, {report.level, report.seconds});
    report.emitted = true;
    play_guarded(plan, playing, modulation, link, *signals, report);
  } else if (plan.stream || report.dry) {
    play_dry(plan, frames, playing, *local, report);
  }
  if (signals != nullptr) {
    report.signal = signals->signal();
  }
  if (plan.stream) {
    report.frames = report.play.sent;
  }
  return report;
}

}  // namespace touchfield
