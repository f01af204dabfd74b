#include "apps/commands/emission.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "apps/commands/device_cli.h"
#include "apps/commands/standard_streams.h"
#include "hardware/array_match.h"
#include "hardware/guard/guarded_link.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"
#include "sim/scene/text_file.h"

namespace touchfield {

namespace {

constexpr double kDefaultLevel = 0.5;
constexpr double kDefaultSeconds = 1;

// Numbers 0..255 between blanks, line ends or commas.
std::vector<std::uint8_t> read_samples(const std::string& path) {
  std::string text = schema::read_text_file(path);
  std::replace(text.begin(), text.end(), ',', ' ');
  std::vector<std::uint8_t> samples;
  constexpr const char* kBlanks = " \t\r\n";
  for (std::size_t at = text.find_first_not_of(kBlanks); at != std::string::npos;
       at = text.find_first_not_of(kBlanks, at)) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    const std::string word = text.substr(at, end - at);
    const bool digits = word.size() <= 3 && word.find_first_not_of("0123456789") == std::string::npos;
    if (!digits || std::stoi(word) > 255) {
      throw InputError(fmt::format("{}: sample {} is '{}', it must be a whole number from 0 to 255", path,
                                   samples.size() + 1, word));
    }
    samples.push_back(static_cast<std::uint8_t>(std::stoi(word)));
    at = end;
  }
  return samples;
}

Modulation chosen_modulation(const DeviceOptions& options, const LinkAbilities& abilities) {
  if (!options.samples.empty()) {
    return SampledModulation{read_samples(options.samples), abilities.modulation.rate};
  }
  if (options.frequency) {
    return SineModulation{*options.frequency, options.depth};
  }
  return StaticModulation{};
}

double chosen_level(const DeviceOptions& options, const LinkAbilities& abilities, const std::string& device) {
  if (!(options.most_level > 0 && options.most_level <= 1)) {
    throw InputError(fmt::format("--max-level = {} must be > 0 and <= 1", options.most_level));
  }
  const bool fixed = abilities.steps.intensity_levels == 2;
  const double level = options.level.value_or(fixed ? 1.0 : std::min(kDefaultLevel, options.most_level));
  if (!(level > 0 && level <= 1)) {
    throw InputError(fmt::format("--level = {} must be > 0 and <= 1", level));
  }
  if (fixed && level != 1) {
    throw InputError(
        fmt::format("--level = {}: {} drives its transducers fully or not at all, level 1; its supply "
                    "voltage sets the pressure",
                    level, device));
  }
  if (level > options.most_level) {
    throw InputError(fmt::format("level = {} must be <= {}{}; --max-level raises the cap", level, options.most_level,
                                 fixed ? fmt::format(" and {} has no other", device) : ""));
  }
  return level;
}

double chosen_seconds(const EmissionPlan& plan, std::size_t frames) {
  const double most = plan.device.most_seconds;
  if (!(most > 0) || !std::isfinite(most)) {
    throw InputError(fmt::format("--max-seconds = {} must be > 0 and finite", most));
  }
  const double once = frames == 1 ? kDefaultSeconds : static_cast<double>(frames) / plan.rate;
  const double seconds = plan.seconds.value_or(once);
  if (!(seconds > 0) || !std::isfinite(seconds)) {
    throw InputError(fmt::format("--seconds = {} must be > 0 and finite", seconds));
  }
  if (seconds > most) {
    throw InputError(fmt::format("{:g} s of emission must be <= {:g} s; --max-seconds raises the cap", seconds, most));
  }
  return seconds;
}

void require_rate(double rate, const ArrayLink& link) {
  const double most = link.abilities().most_frames_per_second;
  if (!(rate > 0 && rate <= most)) {
    throw InputError(
        fmt::format("{:g} frames a second must be > 0 and <= {:g}, what {} carries", rate, most, link.describe()));
  }
}

void require_equal(const DriveFrame& sent, ArrayLink& link) {
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

void require_equal(const Modulation& sent, ArrayLink& link) {
  const std::optional<std::vector<std::uint8_t>> held = link.read_back_modulation();
  if (!held) {
    return;
  }
  const std::vector<std::uint8_t> wanted = modulation_samples(sent, link.abilities().modulation);
  bool same = !held->empty() && held->size() % wanted.size() == 0;  // a device may hold more than one period
  for (std::size_t k = 0; same && k < held->size(); ++k) {
    same = (*held)[k] == wanted[k % wanted.size()];
  }
  if (!same) {
    throw DeviceError(fmt::format("{}: it reads back another modulation than was sent", link.describe()));
  }
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
      require_equal(frame, link);
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
      require_equal(modulation, link);
    }
    report.play = play(frames.size(), source, link, {report.rate, report.seconds, plan.repeat}, pace, observer);
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
  if (signals.signal() != 0) {
    report.exit_code = 128 + signals.signal();
    say(fmt::format("touchfield: stopped by {}\n", StopSignals::name(signals.signal())));
  }
}

}  // namespace

ArrayLayout layout_of(const TransducerArray& array) {
  return {array.positions, array.axes, array.device, array.channel};
}

std::unique_ptr<ArrayLink> local_link(const DeviceOptions& options, const ArrayLayout& array, std::size_t frames) {
  return make_link({options.link, options.library, array, frames, options.force});
}

EmissionReport emit(const EmissionPlan& plan) {
  const LinkAddress address = parse_link_address(plan.device.link);
  const bool dry = address.kind == LinkAddress::Kind::kDryRun;
  // Before a library can start threads of its own, which would take the signals.
  std::optional<StopSignals> signals;
  if (plan.device.emit && !dry) {
    signals.emplace();
  }
  const std::unique_ptr<ArrayLink> local = local_link(plan.device, plan.array);
  for (const TransducerArray& array : plan.must_match) {
    require_match(array, local->layout(), local->describe());
  }
  EmissionReport report;
  report.device = local->describe();
  report.transducers = static_cast<std::size_t>(local->layout().positions.cols());
  report.level = chosen_level(plan.device, local->abilities(), report.device);
  require_rate(plan.rate, *local);
  report.rate = plan.rate;
  const Modulation modulation = chosen_modulation(plan.device, local->abilities());
  require_ability(modulation, local->abilities().modulation, report.device);
  report.modulation = describe(modulation, local->abilities().modulation);
  const RoundedFrames rounded = rounded_frames(plan.drives(local->layout()), report.level, *local);
  report.frames = rounded.frames.size();
  report.quantisation = rounded.report;
  report.seconds = chosen_seconds(plan, report.frames);
  if (dry) {
    const std::unique_ptr<ArrayLink> writer = local_link(plan.device, plan.array, report.frames);
    writer->open();
    for (const DriveFrame& frame : rounded.frames) {
      writer->send(frame);
    }
    report.written = address.path.empty() ? 0 : report.frames;
  } else if (signals) {
    GuardedLink link(watchdog_command(), {plan.device.link, plan.device.library, plan.array, report.frames, false},
                     {report.level, report.seconds});
    report.emitted = true;
    play_guarded(plan, rounded.frames, modulation, link, *signals, report);
  }
  return report;
}

}  // namespace touchfield
