#include "apps/commands/device_options.h"

#include <cmath>

#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "hardware/guard/guard_process.h"
#include "hardware/stop_signals.h"
#include "sim/core/require.h"
#include "sim/scene/number_table.h"

namespace touchfield {

namespace {

std::vector<std::uint8_t> read_samples(const std::string& path) {
  constexpr std::size_t kMostSamples = 1'000'000;
  std::vector<std::uint8_t> samples;
  for (const double sample : schema::read_numbers(path, "sample", schema::between(0, 255), kMostSamples)) {
    require(sample == std::floor(sample), "{}: sample = {} must be a whole number from 0 to 255", path, sample);
    samples.push_back(static_cast<std::uint8_t>(sample));
  }
  return samples;
}

std::string outcome(const EmissionReport& report) {
  if (report.written > 0) {
    return fmt::format("{} file{} written", report.written, report.written == 1 ? "" : "s");
  }
  if (!report.emitted) {
    return fmt::format("nothing was sent: {}{}", report.dry ? "a dry run" : "add --emit to emit sound",
                       report.gaps.longest > kLongestGap ? "; an emission would have stopped at the longest gap" : "");
  }
  return report.silent    ? "the array is silent"
         : report.failure ? "ended by an error"
                          : "stopped by the guard, which says how it left the array";
}

constexpr const char* kGuardName = "link-guard";

}  // namespace

void add_device(CLI::App* command, DeviceOptions& options) {
  command
      ->add_option("--to", options.device.link,
                   "Link to the array: dry-run, dry-run:FILE, sonicsurface:PORT, autd3-udp, ...; `touchfield array "
                   "list` shows all")
      ->type_name("LINK")
      ->capture_default_str();
}

void add_emission(CLI::App* command, DeviceOptions& options) {
  command->add_flag("--emit", options.emit, "Emit sound; without it everything else is done");
  const schema::Range share = schema::above_to(0, 1);
  add_number(command, "--level", options.request.level, share,
             "Level that stands for full amplitude; default: 0.5, or 1 if the device has no other level");
  add_number(command, "--max-level", options.request.most_level, share, "Cap on the level");
  add_number(command, "--max-seconds", options.request.most_seconds, schema::above(0),
             "Cap on the time of emission [s]");
  auto* modulation = add_number(command, "--modulation", options.device.frequency, schema::above(0),
                                "Modulate the amplitude by a sine of this frequency [Hz]");
  add_number(command, "--depth", options.device.depth, share, "Depth of the modulation")->needs(modulation);
  command
      ->add_option("--modulation-samples", options.samples,
                   "File of modulation samples 0..255, repeated at the device's own rate")
      ->excludes(modulation)
      ->type_name(kAnyFile);
  command->add_flag("--force", options.device.replace, "Replace existing files of a dry run");
}

EmissionPlan plan_of(const DeviceOptions& options) {
  EmissionPlan plan;
  plan.device = options.device;
  if (!options.samples.empty()) {
    plan.device.samples = read_samples(options.samples);
    plan.read.push_back(options.samples);
  }
  plan.request = options.request;
  plan.emit = options.emit;
  plan.guard = {"/proc/self/exe", kGuardName};
  return plan;
}

Json emission_value(const EmissionReport& report) {
  const QuantisationReport& rounding = report.quantisation;
  Json value = {{"link", report.link},
                {"device", report.device},
                {"transducers", report.transducers},
                {"frames", report.frames},
                {"rate_hz", report.rate},
                {"seconds", report.seconds},
                {"level", report.level},
                {"modulation", report.modulation},
                {"phase_levels", rounding.steps.phase_levels},
                {"intensity_levels", rounding.steps.intensity_levels},
                {"worst_phase_error_rad", rounding.worst_phase_error},
                {"rms_phase_error_rad", rounding.rms_phase_error},
                {"drive_loss", rounding.worst_drive_loss},
                {"files", report.written},
                {"emitted", report.emitted},
                {"gaps", report.gaps.count},
                {"gaps_begin_at_s", kShownGap},
                {"longest_gap_s", report.gaps.longest}};
  if (report.emitted) {
    value.update({{"silent", report.silent},
                  {"sent", report.play.sent},
                  {"dropped", report.play.dropped},
                  {"late", report.play.late},
                  {"worst_delay_s", report.play.worst_delay},
                  {"seconds_played", report.play.seconds}});
  }
  value["outcome"] = outcome(report);
  return value;
}

int said_exit_code(const EmissionReport& report) {
  if (report.signal == 0) {
    return 0;
  }
  say(fmt::format("touchfield: stopped by {}\n", StopSignals::name(report.signal)));
  return 128 + report.signal;
}

int print_emission(const EmissionReport& report, const CommonFlags& flags, const Json& more) {
  const int code = said_exit_code(report);
  Json value = emission_value(report);
  value.update(more);
  print_value(value, flags);
  if (report.failure) {
    std::rethrow_exception(report.failure);
  }
  return code;
}

void add_link_guard(CLI::App& app, Invocation& invocation) {
  add_hidden_command(app, invocation, kGuardName, [] {
    run_guard();
    return 0;
  });
}

}  // namespace touchfield
