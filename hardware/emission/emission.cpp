#include "hardware/emission/emission.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "hardware/guard/guarded_link.h"
#include "hardware/link_address.h"
#include "hardware/links/dry_run_link.h"
#include "hardware/links/make_link.h"
#include "hardware/stop_signals.h"
#include "sim/core/box_tree.h"
#include "sim/core/errors.h"
#include "sim/core/units.h"

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

// Median distance of a transducer to its nearest neighbour; 0 for a single one.
double pitch_of(const Points& points) {
  if (points.cols() < 2) return 0;
  Eigen::VectorXd squared = nearest_neighbours(points).squared;
  double* const middle = squared.data() + squared.size() / 2;
  std::nth_element(squared.data(), middle, squared.data() + squared.size());
  return std::sqrt(*middle);
}

// Distances from the middle, sorted: the same for the same places in another order.
Eigen::VectorXd shape_of(const Points& points) {
  const Vector3 centre = points.rowwise().mean();
  Eigen::VectorXd distances = (points.colwise() - centre).colwise().norm();
  std::sort(distances.begin(), distances.end());
  return distances;
}

// The places and, in front of each, a point on the axis.
Points places_and_tips(const Points& positions, const Points& axes) {
  Points points(3, 2 * positions.cols());
  points << positions, positions + kMatchReach * axes;
  return points;
}

std::string what_differs(const Points& run, const Points& device, Eigen::Index worst, double miss) {
  const double run_pitch = pitch_of(run);
  const double device_pitch = pitch_of(device);
  if (std::abs(run_pitch - device_pitch) > 1e-3 * device_pitch) {
    return fmt::format("pitch {:.3f} mm, the device's is {:.3f} mm", run_pitch / kMillimetre,
                       device_pitch / kMillimetre);
  }
  const bool same_shape = (shape_of(run) - shape_of(device)).cwiseAbs().maxCoeff() <= kMatchTolerance;
  return fmt::format("{}: transducer {} is {:.2f} mm away from the device's",
                     same_shape ? "its transducers are in another order, are mirrored, or face another direction"
                                : "its transducers are in other places",
                     worst, miss / kMillimetre);
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

void require_match(const TransducerArray& run, const ArrayLayout& device, const std::string& name) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(fmt::format("the run's array is not that of {}: {}", name, what));
  };
  if (run.kind == TransducerArray::Kind::kPlaneWave) {
    refuse("it is a plane wave");
  }
  if (run.size() != device.positions.cols()) {
    refuse(fmt::format("{} transducers, the device has {}", run.size(), device.positions.cols()));
  }
  const Points wanted = places_and_tips(run.positions, run.axes);
  const Points there = places_and_tips(device.positions, device.axes);
  const Eigen::Isometry3d motion(Eigen::umeyama(there, wanted, false));
  Eigen::Index worst = 0;
  const double miss = (motion * there - wanted).colwise().norm().maxCoeff(&worst);
  if (!(miss <= kMatchTolerance)) {
    refuse(what_differs(run.positions, device.positions, worst % run.size(), miss));
  }
  for (Eigen::Index n = 0; n < run.size(); ++n) {
    if (run.device(n) != device.device(n) || run.channel(n) != device.channel(n)) {
      refuse(fmt::format("transducer {} is channel {} of unit {}, the device's is channel {} of unit {}", n,
                         run.channel(n), run.device(n), device.channel(n), device.device(n)));
    }
  }
}

}  // namespace touchfield
