#include "apps/commands/device_options.h"

#include <cmath>

#include "apps/commands/command_line.h"
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
  plan.guard = guard_command();
  return plan;
}

}  // namespace touchfield
